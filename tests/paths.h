// Where tests find what was built and what is in the repository: in the build and the sources that
// they were compiled from, unless the environment has another place for it (LIQUIDBLEND_...), as in
// the image e2e of deploy/Containerfile.  Threads: safe.
#pragma once

#include <string>

namespace liquidblend::paths {

// A program of ours.  LIQUIDBLEND_BINARY_DIR: their folder.
std::string Program(const std::string& name);

// A file or folder of the repository.  LIQUIDBLEND_SOURCE_DIR: its root.
std::string Source(const std::string& path);

// The library of tests/e2e/faults/fault_layer.h.  LIQUIDBLEND_FAULT_LAYER
std::string FaultLayer();

// What tests/ceph.sh was given: its s3.env tells where S3 is.  LIQUIDBLEND_CEPH
std::string CephFolder();

}  // namespace liquidblend::paths
