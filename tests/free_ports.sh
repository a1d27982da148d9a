#!/usr/bin/env bash
# Prints N different ports of 127.0.0.1 that are free at the moment, in one line. They are below the
# range from which the system chooses ports, if enough are free there.
#   tests/free_ports.sh N
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "free_ports.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
[[ $# = 1 && $1 =~ ^[1-9][0-9]*$ ]] || refuse "not a number of ports: $*"
exec python3 - "$1" <<'PYTHON'
import random, socket, sys
with open("/proc/sys/net/ipv4/ip_local_port_range") as file:
    first_of_system = int(file.read().split()[0])
candidates = range(min(10000, first_of_system - 1), first_of_system)
candidates = random.sample(candidates, min(1000, len(candidates))) + [0] * int(sys.argv[1])
sockets = []
for port in candidates:
    if len(sockets) == int(sys.argv[1]):
        break
    s = socket.socket()
    try:
        s.bind(("127.0.0.1", port))
        sockets.append(s)
    except OSError:
        s.close()
if len(sockets) < int(sys.argv[1]):
    sys.exit("free_ports.sh: too few ports are free")
print(*(s.getsockname()[1] for s in sockets))
PYTHON
