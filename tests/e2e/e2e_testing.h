// A store, servers and workers on it, and a client that speaks the bare protocol.
// The store is a data directory, or, if the environment variable LIQUIDBLEND_E2E_TIER is "shared",
// a PostgreSQL of the test's own and the Ceph that ctest starts.
// If LIQUIDBLEND_E2E_SERVERS is HOST:PORT[,HOST:PORT..], these servers and their workers, which run
// already, are tested instead: nothing is started, each start of a server is a turn to the next of
// them, and every test begins by deleting ALL that is in their store.
#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/store/catalog/catalog.h"
#include "google/longrunning/operations.grpc.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/core/store/store_testing.h"
#include "tests/e2e/process.h"

namespace liquidblend::e2e {

using google::longrunning::Operation;

// A file of an animation.
struct NamedBytes {
  std::string name;
  std::string bytes;
};

class E2eTest : public ::testing::Test {
 protected:
  E2eTest();

  // Ball of 162 vertices over 6 frames, moving along x.
  static std::vector<NamedBytes> BallFiles(double velocity_m_per_s);

  // Where the store is.
  struct Place {
    std::string catalog_url;               // empty: a data directory
    std::string blobs_url;                 // s3://bucket
    std::vector<std::string> environment;  // of the programs, as NAME=VALUE
  };
  // Goes on with another store, and a data directory (or cache) that is empty.
  void MoveTo(const Place& place);

  const std::string& data() const { return folder_->path(); }
  // Whether data() is the store's; otherwise it has the cache alone.
  bool HasDataDirectory() const { return place_.catalog_url.empty(); }
  // Where blobs are while they are written: data(), or the cache.
  std::string blob_folder() const;
  // One more handle on the catalog.
  std::unique_ptr<store::Catalog> OpenCatalog() const;

  // On any free port (or the next of LIQUIDBLEND_E2E_SERVERS); connects.
  Process StartServer(int num_workers = 0, const std::vector<std::string>& environment = {});
  // Talks to the server at HOST:PORT from now on.
  void Connect(const std::string& address);
  // Of the server that was connected to last, as `liquidblend --server` takes it.
  const std::string& Address() const { return address_; }
  Process StartWorker(const std::vector<std::string>& environment = {});
  std::vector<std::string> WorkerArguments() const;

  // Sends an animation. With fewer files than there are, it stops in the middle of the last of
  // them.
  grpc::Status Upload(const std::string& id, const std::vector<NamedBytes>& files,
                      const std::string& request_id, Operation& operation);

  Operation ImportBall(const std::string& id, double velocity_m_per_s);
  // Options of registrations: of so many iterations, of which few take no time; and of seconds of
  // work for each target, so that something can happen in the middle of it.
  static v1::RegistrationOptions Iterations(int num_iterations);
  static v1::RegistrationOptions LongWork();
  // balls: a -> targets.
  grpc::Status Register(int num_iterations, Operation& operation,
                        const std::vector<std::string>& targets = {"b"});
  grpc::Status Register(const v1::RegistrationOptions& options, Operation& operation,
                        const std::vector<std::string>& targets = {"b"});

  // The operation at the first moment when `condition` holds for it.
  Operation Watch(const std::string& name, const std::function<bool(const Operation&)>& condition);
  Operation AwaitDone(const std::string& name);

  std::vector<std::string> AnimationNames();
  int NumOperations();

  static v1::Progress ProgressOf(const Operation& operation);

  // Checks that it succeeded.
  static void ExpectSuccess(const Operation& operation);

  // Waits until this holds; it must within Patience().
  static void Await(const std::function<bool()>& condition);

  std::unique_ptr<v1::LiquidBlend::Stub> stub_;
  std::unique_ptr<google::longrunning::Operations::Stub> operations_;

  // Of workers: who is lost, is found out by then. Longer where none is, since a machine that is
  // busier than that loses one.
  std::string lease_ = "1s";

  // Where the store is, as programs take it: flags, and NAME=VALUE of the environment.
  std::vector<std::string> StoreArguments() const;
  std::vector<std::string> WithStore(const std::vector<std::string>& environment = {}) const;

 private:
  void ConnectToNextRunningServer();
  void DeleteEverything();

  std::unique_ptr<store::TemporaryFolder> folder_;
  Place place_;
  const std::vector<std::string> running_servers_;  // empty: the test starts them
  bool is_empty_ = false;                           // DeleteEverything() has been called
  std::string address_;
};

// The mesh in a frame's bytes.
mesh::TriangleMesh Decode(const std::string& draco);

}  // namespace liquidblend::e2e
