#!/usr/bin/env bash
# Prints the secrets of a trial, with new passwords (docs/operations/kubernetes.md):
#   deploy/kubernetes/make-secrets.sh | kubectl create --namespace liquidblend -f -
#   deploy/kubernetes/make-secrets.sh HOST    another host of PostgreSQL than liquidblend-postgres
# liquidblend-database: url, for servers and workers; password, for PostgreSQL.
# liquidblend-s3: credentials, a file as AWS' programs read it.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "make-secrets.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
host=${1:-liquidblend-postgres}
random() { od -An -N20 -tx1 /dev/urandom | tr -d ' \n'; }

password=$(random)
cat <<YAML
apiVersion: v1
kind: Secret
metadata:
  name: liquidblend-database
stringData:
  password: "$password"
  url: postgresql://liquidblend:$password@$host:5432/liquidblend
---
apiVersion: v1
kind: Secret
metadata:
  name: liquidblend-s3
stringData:
  credentials: |
    [default]
    aws_access_key_id = $(random)
    aws_secret_access_key = $(random)
YAML
