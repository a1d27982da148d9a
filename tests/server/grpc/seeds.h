// Requests that are right, for tests that then spoil them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/server/grpc/raw_call.h"

namespace liquidblend::server {

// In protobuf's text format, by method; of those that are streams, several.
inline const std::map<std::string, std::vector<std::string>> kSeeds = {
    {"UploadAnimation",
     {R"(header { animation_id: "drop" options { frames_per_second: 24 frame_times: [0, 1] } })",
      R"(file { name: "f1.ply" size_bytes: 3 })", R"(chunk: "abc")"}},
    {"PresignUpload", {R"(animation_id: "drop" files { size_bytes: 3
         checksum: "xxh3-00000000000000000000000000000000" })"}},
    {"ImportAnimation", {R"(animation_id: "drop" location: "sims/shot" request_id: "r")"}},
    {"RegisterFamily", {R"(family_id: "other" source: "animations/a" targets: "animations/b"
         options { max_iterations: 3 sample_share: 0.5 } space_time { spacing_edges: 1 }
         correspondences { correspondences { kind: POINT
             source { position { x: 1 y: 2 z: 3 } time_s: 0.1 }
             target { position { x: 1 y: 2 z: 3 } time_s: 0.1 } } }
         time_blending { kind: SQUARES rest_time_s: -1 }
         parameter_space { names: "height" points { values: 0 } points { values: 1 }
           interpolation: LINEAR })"}},
    {"GetFrame",
     {R"(family: "families/splash" weights: 0.5 time_s: 0.1 encoding { position_bits: 12 }
         surface { smoothing_passes: 2 attributes: NORMALS } parameters { name: "h" value: 1 })"}},
    {"GetAnimationFrame", {R"(animation: "animations/a" time_s: 0.1 encoding { position_bits: 12 }
         attributes: NORMALS)"}},
    {"MeasureCorrespondences",
     {R"(family: "families/splash" correspondences { kind: SPACE length_s: 0.1
             source { position { x: 1 y: 2 z: 3 } time_s: 0.1 }
             target { position { x: 1 y: 2 z: 3 } time_s: 0.1 } })"}},
    {"ListOperations", {R"(name: "operations" page_size: 3)"}},
    {"StreamFrames",
     {R"(family: "families/splash" weights: 0.5 time_s: 0.1 rate: 2 frames_per_second: 200)",
      R"(weights: 0.75 loop: true encoding { preset: BALANCED })"}}};

// As bytes.
inline std::vector<std::string> SeedsOf(const MethodDescriptor& method) {
  const auto seeds = kSeeds.find(method.name());
  std::vector<std::string> messages;
  if (seeds == kSeeds.end()) {
    const bool has_name = method.input_type()->FindFieldByName("name") != nullptr;
    messages.push_back(FromText(method, has_name ? "name: \"families/splash\"" : "page_size: 3"));
  } else {
    for (const std::string& text : seeds->second) messages.push_back(FromText(method, text));
  }
  return messages;
}

}  // namespace liquidblend::server
