#!/usr/bin/env bash
# One-node Ceph with radosgw in a container: S3 on port 7480. No copy of anything: for trials.
#   AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY   of the only user; or
#   AWS_SHARED_CREDENTIALS_FILE                a file with aws_access_key_id, aws_secret_access_key
#   S3_BUCKET=liquidblend                      made at the first start
#   S3_BYTES=8589934592                        of the disk file in the volume
#   s3.sh            in the foreground
#   s3.sh --check    exit 0 if it answers
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "s3.sh: $1" >&2; usage >&2; exit 2; }
directory=/var/lib/ceph/one
config=$directory/ceph.conf
bucket=${S3_BUCKET:-liquidblend}
url=http://127.0.0.1:7480
admin=(ceph -c "$config" -k "$directory/keyring")

case ${1:-} in
  '') ;;
  --check) exec curl -s -o /dev/null --max-time 4 "$url/" ;;
  --help) usage; exit 0 ;;
  *) refuse "unknown argument: $1" ;;
esac

# await SECONDS COMMAND...
await() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ $SECONDS -lt $end ] || { echo "s3.sh: gave up waiting for: $*" >&2; return 1; }
    sleep 0.2
  done
}

write_config() {
  cat >"$config" <<CONFIG
[global]
fsid = $(cat /proc/sys/kernel/random/uuid)
mon host = [v2:127.0.0.1:3300/0,v1:127.0.0.1:6789/0]
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
osd objectstore = bluestore
bluestore block size = ${S3_BYTES:-8589934592}
bluestore block create = true
osd memory target = 939524096
ms bind ipv6 = false
keyring = $directory/keyring
run dir = /tmp
admin socket = /tmp/\$name.\$pid.asok
log to file = false
log to stderr = true
err to stderr = true
pid file = /tmp/\$name.pid
crash dir = /tmp
mon data = $directory/mon
osd data = $directory/osd
rgw data = $directory/rgw
rgw frontends = beast port=7480 tcp_nodelay=1
rgw enable usage log = false
rgw thread pool size = 32
mon cluster log to file = false
debug rgw = 0
debug mon = 0
CONFIG
}

write_keys() {
  local keyring=$directory/keyring
  ceph-authtool -C "$keyring" --gen-key -n mon. --cap mon 'allow *'
  ceph-authtool "$keyring" --gen-key -n client.admin --cap mon 'allow *' --cap osd 'allow *' \
    --cap mgr 'allow *'
  ceph-authtool "$keyring" --gen-key -n client.rgw --cap mon 'allow rwx' --cap osd 'allow rwx'
  ceph-authtool "$keyring" --gen-key -n osd.0 --cap mon 'allow profile osd' \
    --cap mgr 'allow profile osd' --cap osd 'allow *'
}

make_cluster() {
  rm -rf "$directory"/{mon,osd,rgw,ceph.conf,keyring,monmap}  # of a first start that was cut off
  mkdir -p "$directory"/{mon,osd,rgw}
  write_config
  write_keys
  monmaptool --create --fsid "$(sed -n 's/^fsid = //p' "$config")" \
    --addv a '[v2:127.0.0.1:3300,v1:127.0.0.1:6789]' "$directory/monmap"
  ceph-mon -c "$config" --mkfs -i a --monmap "$directory/monmap" --keyring "$directory/keyring"
}

make_disk() {
  local uuid
  uuid=$(cat /proc/sys/kernel/random/uuid)
  echo "{\"cephx_secret\":\"$(ceph-authtool -p -n osd.0 "$directory/keyring")\"}" |
    "${admin[@]}" osd new "$uuid" -i -
  ceph-osd -c "$config" -i 0 --mkfs --osd-uuid "$uuid" --no-mon-config
}

take_keys() {
  [ -z "${AWS_ACCESS_KEY_ID:-}" ] && [ -n "${AWS_SHARED_CREDENTIALS_FILE:-}" ] || return 0
  AWS_ACCESS_KEY_ID=$(sed -n 's/^aws_access_key_id *= *//p' "$AWS_SHARED_CREDENTIALS_FILE")
  AWS_SECRET_ACCESS_KEY=$(sed -n 's/^aws_secret_access_key *= *//p' "$AWS_SHARED_CREDENTIALS_FILE")
}

make_bucket() {
  take_keys
  radosgw-admin -c "$config" -k "$directory/keyring" user create --uid=liquidblend \
    --display-name=liquidblend --access-key="${AWS_ACCESS_KEY_ID:?}" \
    --secret-key="${AWS_SECRET_ACCESS_KEY:?}" >/dev/null
  curl -sf --aws-sigv4 aws:amz:us-east-1:s3 --user "$AWS_ACCESS_KEY_ID:$AWS_SECRET_ACCESS_KEY" \
    -H "x-amz-content-sha256: $(printf '' | sha256sum | cut -d' ' -f1)" -X PUT "$url/$bucket"
}

is_new=0
[ -f "$directory/ready" ] || is_new=1
[ $is_new = 0 ] || make_cluster
ceph-mon -c "$config" -i a -f &
[ $is_new = 0 ] || make_disk
ceph-osd -c "$config" -i 0 -f &
await 60 sh -c '"$@" osd stat | grep -q "1 up"' sh "${admin[@]}"
radosgw -c "$config" -n client.rgw -k "$directory/keyring" -f &
trap 'kill $(jobs -p); wait' TERM INT
await 90 curl -s "$url/"
if [ $is_new = 1 ]; then
  make_bucket
  touch "$directory/ready"
fi
echo "S3 on port 7480, bucket $bucket"
wait -n  # each of the three is needed
kill $(jobs -p)
wait
