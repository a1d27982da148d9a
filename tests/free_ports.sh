#!/usr/bin/env bash
# Prints N different ports of 127.0.0.1 that are free at the moment, in one line.
#   tests/free_ports.sh N
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "free_ports.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
[[ $# = 1 && $1 =~ ^[1-9][0-9]*$ ]] || refuse "not a number of ports: $*"
exec python3 - "$1" <<'PYTHON'
import socket, sys
sockets = [socket.socket() for _ in range(int(sys.argv[1]))]
for s in sockets:
    s.bind(("127.0.0.1", 0))
print(*(s.getsockname()[1] for s in sockets))
PYTHON
