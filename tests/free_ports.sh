#!/usr/bin/env bash
# Prints N different ports of 127.0.0.1 that are free at the moment, in one line.
#   tests/free_ports.sh N
set -euo pipefail
[[ $# = 1 && $1 =~ ^[1-9][0-9]*$ ]] || { echo "usage: tests/free_ports.sh N" >&2; exit 2; }
exec python3 - "$1" <<'PYTHON'
import socket, sys
sockets = [socket.socket() for _ in range(int(sys.argv[1]))]
for s in sockets:
    s.bind(("127.0.0.1", 0))
print(*(s.getsockname()[1] for s in sockets))
PYTHON
