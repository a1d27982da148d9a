#!/usr/bin/env bash
# A throw-away object store: one-node Ceph in memory with radosgw, on free ports of 127.0.0.1.
#   tests/ceph.sh start DIRECTORY     up to 30 s; then DIRECTORY/s3.env says where it is
#   tests/ceph.sh stop DIRECTORY      also after a start that failed
# DIRECTORY is emptied by start. The bucket `liquidblend` is there.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "ceph.sh: $1" >&2; usage >&2; exit 2; }
command=${1:-}
case $command in
  --help) usage; exit 0 ;;
  start | stop) [ $# = 2 ] || refuse "$command wants one DIRECTORY" ;;
  *) refuse "unknown command: $command" ;;
esac
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$2"
directory=$(cd "$2" && pwd)
config=$directory/ceph.conf
admin=(ceph -c "$config" -k "$directory/keyring")
as_root=()
[ "$(id -u)" != 0 ] || as_root=(--setuser root --setgroup root)

# await SECONDS COMMAND...
await() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ $SECONDS -lt $end ] || { echo "ceph.sh: gave up waiting for: $*" >&2; return 1; }
    sleep 0.2
  done
}

write_config() {
  cat >"$config" <<CONFIG
[global]
fsid = $fsid
mon host = [v2:127.0.0.1:$1/0,v1:127.0.0.1:$2]
public network = 127.0.0.0/8
cluster network = 127.0.0.0/8
public addr = 127.0.0.1
cluster addr = 127.0.0.1
auth cluster required = cephx
auth service required = cephx
auth client required = cephx
auth allow insecure global id reclaim = false
osd pool default size = 1
osd pool default min size = 1
osd pool default pg num = 1
mon allow pool size one = true
mon warn on pool no redundancy = false
mon max pg per osd = 1000
osd crush chooseleaf type = 0
osd objectstore = memstore
memstore device bytes = 2147483648
osd memory target = 939524096
ms bind ipv6 = false
keyring = $directory/keyring
run dir = $directory/run
admin socket = $directory/run/\$name.\$pid.asok
log file = $directory/log/\$name.log
pid file = $directory/run/\$name.pid
mon data = $directory/mon
osd data = $directory/osd
rgw data = $directory/rgw
rgw frontends = beast endpoint=127.0.0.1:$3 tcp_nodelay=1
rgw enable usage log = false
rgw thread pool size = 32
CONFIG
}

write_keys() {
  ceph-authtool -C "$directory/keyring" --gen-key -n mon. --cap mon 'allow *'
  ceph-authtool "$directory/keyring" --gen-key -n client.admin --cap mon 'allow *' \
    --cap osd 'allow *' --cap mgr 'allow *'
  ceph-authtool "$directory/keyring" --gen-key -n client.rgw --cap mon 'allow rwx' \
    --cap osd 'allow rwx'
  ceph-authtool "$directory/keyring" --gen-key -n osd.0 --cap mon 'allow profile osd' \
    --cap mgr 'allow profile osd' --cap osd 'allow *'
}

start() {
  stop  # what an interrupted run has left
  mkdir -p "$directory"/{mon,osd,rgw,run,log}
  local mon_v2 mon_v1 rgw uuid fsid
  read -r mon_v2 mon_v1 rgw < <("$here/free_ports.sh" 3)
  fsid=$(cat /proc/sys/kernel/random/uuid)
  uuid=$(cat /proc/sys/kernel/random/uuid)
  write_config "$mon_v2" "$mon_v1" "$rgw"
  {
    write_keys
    monmaptool --create --fsid "$fsid" --addv a "[v2:127.0.0.1:$mon_v2,v1:127.0.0.1:$mon_v1]" \
      "$directory/monmap"
    ceph-mon -c "$config" --mkfs -i a --monmap "$directory/monmap" --keyring "$directory/keyring"
    ceph-mon -c "$config" -i a "${as_root[@]}"
    echo "{\"cephx_secret\":\"$(ceph-authtool -p -n osd.0 "$directory/keyring")\"}" |
      "${admin[@]}" osd new "$uuid" -i -
    ceph-osd -c "$config" -i 0 --mkfs --osd-uuid "$uuid" --no-mon-config
    ceph-osd -c "$config" -i 0
    await 30 sh -c '"$@" osd stat | grep -q "1 up"' sh "${admin[@]}"
    radosgw -c "$config" -n client.rgw -k "$directory/keyring"
    await 60 curl -s "http://127.0.0.1:$rgw/"
    radosgw-admin -c "$config" -k "$directory/keyring" user create --uid=liquidblend \
      --display-name=liquidblend --access-key=liquidblendkey --secret-key=liquidblendsecret
    curl -sf --aws-sigv4 aws:amz:us-east-1:s3 --user liquidblendkey:liquidblendsecret \
      -H "x-amz-content-sha256: $(printf '' | sha256sum | cut -d' ' -f1)" -X PUT \
      "http://127.0.0.1:$rgw/liquidblend"
  } >"$directory/start.log" 2>&1 || { cat "$directory/start.log" >&2; stop; exit 1; }
  cat >"$directory/s3.env" <<ENV
AWS_ENDPOINT_URL=http://127.0.0.1:$rgw
AWS_ACCESS_KEY_ID=liquidblendkey
AWS_SECRET_ACCESS_KEY=liquidblendsecret
ENV
}

stop() {
  local pid
  for file in "$directory"/run/*.pid; do
    [ -f "$file" ] || continue
    pid=$(cat "$file")
    grep -qa -e "$config" "/proc/$pid/cmdline" 2>/dev/null || continue  # gone, or not ours
    kill "$pid" 2>/dev/null || continue
    await 20 sh -c "! kill -0 $pid" || kill -9 "$pid" 2>/dev/null || true
  done
  rm -rf "$directory"
}

"$command"
