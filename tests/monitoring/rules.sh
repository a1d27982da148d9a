#!/usr/bin/env bash
# Checks the rules of deploy/monitoring and its configuration of Prometheus, and lets each alert
# fire and clear on made-up series (rules/*.test.yml).
#   tests/monitoring/rules.sh [PROMTOOL]
# Exit: 0 if all is well; 1 if not; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "rules.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
promtool=${1:-promtool}
cd "$(dirname "$0")/../.."
"$promtool" check rules deploy/monitoring/prometheus/rules/*.yml
"$promtool" check config deploy/monitoring/prometheus/prometheus.yml
"$promtool" test rules tests/monitoring/rules/*.test.yml
