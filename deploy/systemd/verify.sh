#!/usr/bin/env bash
# Lets systemd check the units as install.sh would put them (no systemd needs to run), and how open
# they are: below 3 of 10.
#   deploy/systemd/verify.sh
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "verify.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  '') ;;
  --help) usage; exit 0 ;;
  *) refuse "unknown argument: $1" ;;
esac
command -v systemd-analyze >/dev/null || {
  echo "verify.sh: there is no systemd-analyze here; install the package systemd" >&2
  exit 1
}
cd "$(dirname "$0")"
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mkdir "$root/programs"
for program in liquidblend liquidblend-{admin,server,worker}; do
  install /bin/true "$root/programs/$program"
done
DESTDIR=$root ./install.sh "$root/programs"
cp -r liquidblend-worker@.service.d "$root/usr/lib/systemd/system/"
# What the units refer to and systemd itself brings.
cp -rn /usr/lib/systemd/system/{*.target,*.slice,*.socket} "$root/usr/lib/systemd/system/"
mkdir -p "$root/usr/sbin"

units=(liquidblend-server.service liquidblend-worker@1.service)
said=$(systemd-analyze verify --root="$root" --man=no --recursive-errors=no "${units[@]}" 2>&1) || {
  echo "$said" >&2
  exit 1
}
said=$(grep -F liquidblend <<<"$said" || true)
if [ -n "$said" ]; then
  echo "$said" >&2
  exit 1
fi
systemd-sysusers --root="$root" --dry-run "$root/usr/lib/sysusers.d/liquidblend.conf" >/dev/null 2>&1
for unit in liquidblend-server.service liquidblend-worker@.service; do
  systemd-analyze security --offline=yes --root="$root" --threshold=30 --no-pager "$unit" | tail -1
done
