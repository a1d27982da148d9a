#include "tests/e2e/e2e_testing.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/store/data_directory.h"
#include "tests/core/store/blobs/ceph_environment.h"
#include "tests/core/store/sql/postgres_server.h"
#include "tests/synthetic/shapes.h"
#include "tests/worker/ingest/formats/encode_files.h"

namespace liquidblend::e2e {
namespace {

void SetDeadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + Patience());
}

bool IsOnSharedTier() {
  const char* const tier = std::getenv("LIQUIDBLEND_E2E_TIER");
  return tier != nullptr && std::string(tier) == "shared";
}

std::vector<std::string> RunningServers() {
  const char* const servers = std::getenv("LIQUIDBLEND_E2E_SERVERS");
  if (servers == nullptr) return {};
  return absl::StrSplit(servers, ',', absl::SkipEmpty());
}

}  // namespace

E2eTest::E2eTest()
    : folder_(std::make_unique<store::TemporaryFolder>()), running_servers_(RunningServers()) {
  // Commands wait as long as tests do.
  setenv("LIQUIDBLEND_CONNECT_TIMEOUT", absl::StrCat(Patience().count()).c_str(), /*overwrite=*/1);
  if (!IsOnSharedTier()) return;
  place_ = {store::SharedPostgresServer().NewUrl(), "s3://liquidblend", store::CephEnvironment()};
}

void E2eTest::MoveTo(const Place& place) {
  folder_ = std::make_unique<store::TemporaryFolder>();
  place_ = place;
}

std::string E2eTest::blob_folder() const { return HasDataDirectory() ? data() : data() + "/cache"; }

std::unique_ptr<store::Catalog> E2eTest::OpenCatalog() const {
  auto catalog = HasDataDirectory() ? store::OpenSqliteCatalog(store::CatalogPath(data()))
                                    : store::OpenPostgresCatalog(place_.catalog_url);
  EXPECT_TRUE(catalog.ok()) << catalog.status();
  return catalog.ok() ? *std::move(catalog) : nullptr;
}

std::vector<std::string> E2eTest::StoreArguments() const {
  if (HasDataDirectory()) return {"--data", data()};
  return {"--cache", blob_folder(), "--blobs", place_.blobs_url + data().substr(data().rfind('/'))};
}

// The first of a name counts.
std::vector<std::string> E2eTest::WithStore(const std::vector<std::string>& environment) const {
  std::vector<std::string> all = environment;
  if (!HasDataDirectory()) all.push_back("LIQUIDBLEND_STORE=" + place_.catalog_url);
  all.insert(all.end(), place_.environment.begin(), place_.environment.end());
  return all;
}

std::vector<NamedBytes> E2eTest::BallFiles(double velocity_m_per_s) {
  synthetic::MovingSphereOptions options;
  options.velocity_m_per_s = {static_cast<float>(velocity_m_per_s), 0, 0};
  options.num_frames = 6;
  options.subdivisions = 2;
  std::vector<NamedBytes> files;
  for (const ingest::LoadedFile& file :
       ingest::Files(synthetic::MovingSphere(options), ingest::Format::kPly)) {
    files.push_back({file.name, store::AsString(file.bytes)});
  }
  return files;
}

void E2eTest::Connect(const std::string& address) {
  address_ = address;
  const auto channel = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
  stub_ = v1::LiquidBlend::NewStub(channel);
  operations_ = google::longrunning::Operations::NewStub(channel);
}

void E2eTest::ConnectToNextRunningServer() {
  static size_t turn = 0;
  Connect(running_servers_[turn++ % running_servers_.size()]);
  if (!is_empty_) DeleteEverything();
  is_empty_ = true;
}

void E2eTest::DeleteEverything() {
  const auto check = [](const grpc::Status& status) {
    EXPECT_TRUE(status.ok()) << status.error_message();
  };
  google::protobuf::Empty empty;
  v1::ListFamiliesResponse families;
  check(stub_->ListFamilies(std::make_unique<grpc::ClientContext>().get(), {}, &families));
  for (const v1::Family& family : families.families()) {
    v1::DeleteFamilyRequest request;
    request.set_name(family.name());
    check(stub_->DeleteFamily(std::make_unique<grpc::ClientContext>().get(), request, &empty));
  }
  for (const std::string& name : AnimationNames()) {
    v1::DeleteAnimationRequest request;
    request.set_name(name);
    check(stub_->DeleteAnimation(std::make_unique<grpc::ClientContext>().get(), request, &empty));
  }
  google::longrunning::ListOperationsResponse operations;
  check(
      operations_->ListOperations(std::make_unique<grpc::ClientContext>().get(), {}, &operations));
  for (const Operation& operation : operations.operations()) {
    google::longrunning::DeleteOperationRequest request;
    request.set_name(operation.name());
    check(operations_->DeleteOperation(std::make_unique<grpc::ClientContext>().get(), request,
                                       &empty));
  }
}

Process E2eTest::StartServer(int num_workers, const std::vector<std::string>& environment) {
  if (!running_servers_.empty()) {
    ConnectToNextRunningServer();
    return {};
  }
  std::vector<std::string> arguments = StoreArguments();
  arguments.insert(arguments.end(), {"--listen", "127.0.0.1:0", "--worker-lease", lease_,
                                     "--workers", std::to_string(num_workers)});
  Process server("liquidblend-server", arguments, WithStore(environment));
  const std::string line = server.ReadLine();
  const std::string words = "listening on ";
  EXPECT_EQ(line.substr(0, words.size()), words);
  Connect(line.substr(std::min(line.size(), words.size())));
  return server;
}

Process E2eTest::StartWorker(const std::vector<std::string>& environment) {
  if (!running_servers_.empty()) return {};
  return Process("liquidblend-worker", WorkerArguments(), WithStore(environment));
}

std::vector<std::string> E2eTest::WorkerArguments() const {
  std::vector<std::string> arguments = StoreArguments();
  arguments.insert(arguments.end(), {"--lease", lease_, "--poll", "20ms", "--threads", "1"});
  return arguments;
}

grpc::Status E2eTest::Upload(const std::string& id, const std::vector<NamedBytes>& files,
                             const std::string& request_id, Operation& operation) {
  grpc::ClientContext context;
  SetDeadline(context);
  auto writer = stub_->UploadAnimation(&context, &operation);
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id(id);
  message.mutable_header()->set_request_id(request_id);
  bool ok = writer->Write(message);
  for (size_t k = 0; ok && k < files.size(); ++k) {
    message.mutable_file()->set_name(files[k].name);
    message.mutable_file()->set_size_bytes(static_cast<int64_t>(files[k].bytes.size()));
    ok = writer->Write(message);
    message.set_chunk(files[k].bytes);
    ok = ok && writer->Write(message);
  }
  writer->WritesDone();
  return writer->Finish();
}

Operation E2eTest::ImportBall(const std::string& id, double velocity_m_per_s) {
  Operation operation;
  const grpc::Status status = Upload(id, BallFiles(velocity_m_per_s), "", operation);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return operation;
}

v1::RegistrationOptions E2eTest::Iterations(int num_iterations) {
  v1::RegistrationOptions options;
  options.set_max_iterations(num_iterations);
  return options;
}

v1::RegistrationOptions E2eTest::LongWork() {
  v1::RegistrationOptions options = Iterations(200);
  options.set_sample_share(1.0);
  options.set_node_spacing_edges(1.0);
  return options;
}

grpc::Status E2eTest::Register(int num_iterations, Operation& operation,
                               const std::vector<std::string>& targets) {
  return Register(Iterations(num_iterations), operation, targets);
}

grpc::Status E2eTest::Register(const v1::RegistrationOptions& options, Operation& operation,
                               const std::vector<std::string>& targets) {
  v1::RegisterFamilyRequest request;
  request.set_family_id("balls");
  request.set_source("animations/a");
  for (const std::string& target : targets) request.add_targets("animations/" + target);
  *request.mutable_options() = options;
  request.set_replace(true);
  grpc::ClientContext context;
  SetDeadline(context);
  return stub_->RegisterFamily(&context, request, &operation);
}

Operation E2eTest::Watch(const std::string& name,
                         const std::function<bool(const Operation&)>& condition) {
  grpc::ClientContext context;
  SetDeadline(context);
  v1::WatchOperationRequest request;
  request.set_name(name);
  auto reader = stub_->WatchOperation(&context, request);
  Operation operation;
  while (reader->Read(&operation)) {
    if (condition(operation)) return operation;
  }
  const grpc::Status status = reader->Finish();
  ADD_FAILURE() << name << " ended before it came so far: " << operation.DebugString()
                << status.error_message();
  return operation;
}

Operation E2eTest::AwaitDone(const std::string& name) {
  return Watch(name, [](const Operation& operation) { return operation.done(); });
}

std::vector<std::string> E2eTest::AnimationNames() {
  grpc::ClientContext context;
  SetDeadline(context);
  v1::ListAnimationsResponse response;
  const grpc::Status status = stub_->ListAnimations(&context, {}, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  std::vector<std::string> names;
  for (const v1::Animation& animation : response.animations()) names.push_back(animation.name());
  return names;
}

int E2eTest::NumOperations() {
  grpc::ClientContext context;
  SetDeadline(context);
  google::longrunning::ListOperationsResponse response;
  const grpc::Status status = operations_->ListOperations(&context, {}, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.operations_size();
}

v1::Progress E2eTest::ProgressOf(const Operation& operation) {
  v1::RegisterFamilyMetadata registration;
  if (operation.metadata().UnpackTo(&registration)) return registration.progress();
  v1::ImportAnimationMetadata import;
  operation.metadata().UnpackTo(&import);
  return import.progress();
}

void E2eTest::ExpectSuccess(const Operation& operation) {
  EXPECT_TRUE(operation.done());
  EXPECT_TRUE(operation.has_response()) << operation.error().DebugString();
}

void E2eTest::Await(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + Patience();
  while (!condition()) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "did not happen";
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

mesh::TriangleMesh Decode(const std::string& bytes) {
  mesh::TriangleMesh result;
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  EXPECT_TRUE(decoded.ok()) << decoded.status().error_msg();
  if (!decoded.ok()) return result;
  const draco::Mesh& mesh = *decoded.value();
  const auto* positions = mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
  result.vertices.resize(3, mesh.num_points());
  for (uint32_t p = 0; p < mesh.num_points(); ++p) {
    positions->GetMappedValue(draco::PointIndex(p), result.vertices.col(p).data());
  }
  result.triangles.resize(3, mesh.num_faces());
  for (uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(f));
    for (int c = 0; c < 3; ++c) result.triangles(c, f) = static_cast<int>(face[c].value());
  }
  return result;
}

}  // namespace liquidblend::e2e
