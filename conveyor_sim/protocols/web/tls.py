"""TLS for the page, if other machines can reach it: users send passwords."""

from __future__ import annotations

import os
import ssl
from pathlib import Path
from tempfile import NamedTemporaryFile

from conveyor_sim.protocols.server.certificates import KEY, default_folder, identity
from conveyor_sim.protocols.server.interface import ServerError

CHAIN = "certificate.pem"
"""Name of the file beside KEY: certificate signed by an authority, and the certificates that lead to it."""


def server_context(folder: Path | None, of_opcua: Path | None) -> ssl.SSLContext:
    """Return a context for TLS. folder: contains CHAIN and KEY; None: the certificate that the OPC UA server makes, in
    `of_opcua` if given.

    Raises ServerError if it can't be read, CertificateError.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if folder is not None:
        _load(context, folder / CHAIN, folder / KEY)
        return context
    own_folder = of_opcua or default_folder()
    own = identity(own_folder)
    # The standard library reads certificates from named files only.
    with NamedTemporaryFile("w", suffix=".pem") as chain:
        chain.write(ssl.DER_cert_to_PEM_cert(own.certificate))
        chain.flush()
        _load(context, Path(chain.name), own_folder / KEY)
    return context


def _load(context: ssl.SSLContext, chain: Path, key: Path) -> None:
    for path in (chain, key):
        if not os.access(path, os.R_OK) or not path.is_file():
            raise ServerError(f"{path}: can't be read, expected a certificate and its key: {CHAIN} and {KEY}")
    try:
        context.load_cert_chain(chain, key, password=lambda: "")  # instead of asking at the terminal
    except (OSError, ValueError) as error:
        raise ServerError(f"{chain}: {error}, expected a certificate in PEM, and its key in {key.name}") from error
