# SPDX-License-Identifier: Apache-2.0
"""Types of columns."""

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]
U4 = NDArray[np.uint32]
I1 = NDArray[np.int8]
I4 = NDArray[np.int32]
I8 = NDArray[np.int64]
