#!/usr/bin/env bash
# Writes postgres.env, s3.env and store.env for many-machines.yaml, with new passwords, readable by
# their owner alone. Leaves what is there as it is.
#   deploy/compose/make-secrets.sh [DIRECTORY]    default: beside this script
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "make-secrets.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
cd "${1:-$(dirname "$0")}"
umask 077
random() { od -An -N20 -tx1 /dev/urandom | tr -d ' \n'; }

for file in postgres.env s3.env store.env; do
  [ ! -e $file ] || { echo "make-secrets: $file is there already" >&2; exit 1; }
done
password=$(random)
cat >postgres.env <<ENV
POSTGRES_USER=liquidblend
POSTGRES_PASSWORD=$password
POSTGRES_DB=liquidblend
ENV
cat >s3.env <<ENV
AWS_ENDPOINT_URL=http://s3:7480
AWS_ACCESS_KEY_ID=$(random)
AWS_SECRET_ACCESS_KEY=$(random)
ENV
echo "LIQUIDBLEND_STORE=postgresql://liquidblend:$password@postgres:5432/liquidblend" >store.env
