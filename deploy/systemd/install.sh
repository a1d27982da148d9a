#!/usr/bin/env bash
# Puts programs, units and user onto this machine.
#   deploy/systemd/install.sh [PROGRAMS]    default build/release/bin; run as root
#   DESTDIR=DIR                             below DIR, without telling systemd
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "install.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
cd "$(dirname "$0")"
programs=$(cd "${1:-../../build/release/bin}" && pwd)
root=${DESTDIR:-}

install -D -t "$root/usr/bin" "$programs"/liquidblend{,-admin,-server,-worker}
install -D -m 644 -t "$root/usr/lib/systemd/system" liquidblend-server.service liquidblend-worker@.service
install -D -m 644 liquidblend.sysusers "$root/usr/lib/sysusers.d/liquidblend.conf"
for page in $(cd ../../docs && find . -name '*.md'); do
  install -D -m 644 "../../docs/$page" "$root/usr/share/doc/liquidblend/$page"
done
install -d -m 750 "$root/etc/liquidblend"
for sample in server.env worker.env; do  # what an operator has written stays
  [ -e "$root/etc/liquidblend/$sample" ] || install -m 640 "$sample" "$root/etc/liquidblend/$sample"
done
[ -n "$root" ] || systemd-sysusers
# The server's user reaches what lies below; the samples stay root's, for systemd to read. Below
# DESTDIR the group may not exist yet: then whoever puts the tree into its place does this.
group=$(awk -F: '$1 == "liquidblend" { print $3 }' "$root/etc/group" 2>/dev/null || true)
[ -z "$group" ] || chgrp "$group" "$root/etc/liquidblend"
if [ -n "$root" ]; then exit 0; fi
systemctl daemon-reload
echo "next: systemctl enable --now liquidblend-server"
