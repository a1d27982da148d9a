// Families, and lists of names.
#include <utility>

#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"

namespace liquidblend::c_api {

std::unique_ptr<lb_family> MakeFamily(player::FamilyFacts facts, std::string source,
                                      std::string json) {
  auto family = std::make_unique<lb_family>();
  family->facts = std::move(facts);
  family->source = std::move(source);
  family->json = std::move(json);
  for (const std::string& target : family->facts.targets) family->targets.push_back(target.c_str());
  const ParameterSpace& space = family->facts.parameter_space;
  for (const std::string& name : space.names) family->parameters.push_back(name.c_str());
  for (const std::vector<double>& point : space.points) {
    family->points.insert(family->points.end(), point.begin(), point.end());
  }
  return family;
}

void Describe(const lb_family& family, lb_family_info* info) {
  const player::FamilyFacts& facts = family.facts;
  lb_family_info out = {};
  out.name = facts.name.c_str();
  out.version = facts.version;
  out.source = family.source.c_str();
  out.num_targets = family.targets.size();
  out.targets = family.targets.data();
  out.duration_s = facts.duration_s;
  out.frames_per_second = facts.frames_per_second;
  out.up = static_cast<lb_up>(facts.up);  // the same numbers
  const Vector3 &low = facts.bounds.min, &high = facts.bounds.max;
  out.bounds_min[0] = low.x, out.bounds_min[1] = low.y, out.bounds_min[2] = low.z;
  out.bounds_max[0] = high.x, out.bounds_max[1] = high.y, out.bounds_max[2] = high.z;
  out.num_levels = facts.num_levels;
  out.num_parameters = family.parameters.size();
  out.parameters = family.parameters.data();
  out.points = family.points.data();
  out.json = family.json.c_str();
  Write(out, info);
}

}  // namespace liquidblend::c_api

extern "C" {

void lb_family_describe(const lb_family* family, lb_family_info* info) {
  if (family != nullptr) liquidblend::c_api::Describe(*family, info);
}

void lb_family_free(lb_family* family) { delete family; }

const char* lb_text_get(const lb_text* text) { return text == nullptr ? "" : text->text.c_str(); }

void lb_text_free(lb_text* text) { delete text; }

}  // extern "C"
