# SPDX-License-Identifier: Apache-2.0
"""Every Python that starts while an interface package is built runs this: each IDL file is parsed once.

ROS has nine generators, and each would parse all files, which takes two thirds of its time.
"""

import os
import pickle
import sys
from hashlib import sha256
from pathlib import Path

if "rosidl" in "".join(sys.orig_argv[1:2]):
    from rosidl_parser import parser

    parse = getattr(parser, "get_ast_from_idl_string", None)
    folder = Path(os.environ["PARSED_INTERFACES"])

    def parse_once(text: str) -> object:
        """Return the syntax tree of an IDL file's text, parsed once."""
        file = folder / f"{sha256(text.encode()).hexdigest()}.pickle"
        if file.exists():
            return pickle.loads(file.read_bytes())
        tree = parse(text)
        draft = file.with_suffix(f".{os.getpid()}")
        draft.write_bytes(pickle.dumps(tree))
        draft.replace(file)
        return tree

    if parse:
        parser.get_ast_from_idl_string = parse_once
