// Metric families whose values are known now, for Prometheus' library.
#pragma once

#include <prometheus/metric_family.h>

#include <cstdint>
#include <map>
#include <string>

namespace liquidblend::metrics {

// A gauge without labels.
prometheus::MetricFamily OneGauge(std::string name, std::string help, double value);

// A counter without labels.
prometheus::MetricFamily OneCounter(std::string name, std::string help, double value);

// A gauge with one value for each value of a label.
prometheus::MetricFamily Gauges(std::string name, std::string help, const std::string& label,
                                const std::map<std::string, int64_t>& values);

// A counter with one value for each value of a label.
prometheus::MetricFamily CountersOf(std::string name, std::string help, const std::string& label,
                                    const std::map<std::string, int64_t>& values);

}  // namespace liquidblend::metrics
