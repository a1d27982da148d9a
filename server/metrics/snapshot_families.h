// A snapshot, and the process itself, as metric families.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

#include "server/metrics/snapshot.h"

namespace liquidblend::metrics {

// Adds the metrics of a snapshot.
void AddSnapshot(const Snapshot& now, std::vector<prometheus::MetricFamily>& all);

// Adds the process' memory and processor time, by the names that all programs use.
void AddProcess(std::vector<prometheus::MetricFamily>& all);

}  // namespace liquidblend::metrics
