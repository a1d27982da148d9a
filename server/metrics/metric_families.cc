#include "server/metrics/metric_families.h"

#include <utility>

namespace liquidblend::metrics {
namespace {

using prometheus::MetricFamily;
using prometheus::MetricType;

// An empty label means that there is one value.
MetricFamily Values(MetricType type, std::string name, std::string help, const std::string& label,
                    const std::map<std::string, double>& values) {
  MetricFamily family{std::move(name), std::move(help), type, {}};
  for (const auto& [key, value] : values) {
    prometheus::ClientMetric metric;
    if (!label.empty()) metric.label.push_back({label, key});
    (type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
    family.metric.push_back(std::move(metric));
  }
  return family;
}

}  // namespace

MetricFamily OneGauge(std::string name, std::string help, double value) {
  return Values(MetricType::Gauge, std::move(name), std::move(help), "", {{"", value}});
}

MetricFamily OneCounter(std::string name, std::string help, double value) {
  return Values(MetricType::Counter, std::move(name), std::move(help), "", {{"", value}});
}

MetricFamily Gauges(std::string name, std::string help, const std::string& label,
                    const std::map<std::string, int64_t>& values) {
  return Values(MetricType::Gauge, std::move(name), std::move(help), label,
                {values.begin(), values.end()});
}

MetricFamily CountersOf(std::string name, std::string help, const std::string& label,
                        const std::map<std::string, int64_t>& values) {
  return Values(MetricType::Counter, std::move(name), std::move(help), label,
                {values.begin(), values.end()});
}

}  // namespace liquidblend::metrics
