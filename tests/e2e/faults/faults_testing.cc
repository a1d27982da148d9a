#include "tests/e2e/faults/faults_testing.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/store/data_directory.h"

namespace liquidblend::e2e {
namespace {

namespace fs = std::filesystem;
using store::pb::JobRecord;

constexpr auto kPoll = std::chrono::milliseconds(5);
constexpr double kImportVelocity = 3.0;
constexpr char kImported[] = "c";
constexpr char kRegistration[] = "registration";
constexpr char kImport[] = "import";

void SetDeadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + Slowness() * std::chrono::seconds(20));
}

}  // namespace

int NumFaultRuns() {
  const char* const runs = std::getenv("LIQUIDBLEND_FAULT_RUNS");
  return runs == nullptr ? 1 : std::max(1, std::atoi(runs));
}

FaultLine::~FaultLine() {
  EXPECT_GT(num_runs, 0);
  EXPECT_THAT(lost, testing::IsEmpty()) << fault_;
  const char* const table = std::getenv("LIQUIDBLEND_FAULT_TABLE");
  if (table == nullptr) return;
  std::ofstream(table, std::ios::app) << absl::StrCat(
      "| ", fault_, " | ", tier_ == Tier::kEmbedded ? "embedded" : "shared", " | ", num_runs, " | ",
      num_accepted, " | ", num_retried, " | ", num_published, " | ", lost.size(), " |\n");
}

FaultTest::FaultTest() = default;
FaultTest::~FaultTest() = default;

void FaultTest::BeginRun(FaultLine& line, Tier tier) {
  line_ = &line;
  tier_ = tier;
  run_ = ++line.num_runs + line.num_missed;
  names_.clear();
  errors_.clear();
  catalog_.reset();
  if (expected_.frame.empty()) return MakeStore();
  if (tier == Tier::kShared) return;
  MoveTo({});
  fs::copy(template_->path(), data(), fs::copy_options::recursive);
  num_versions_ = 1;
}

void FaultTest::Each(const std::string& fault, const std::function<void(int)>& run_once) {
  FaultLine line(fault, Tier::kShared);
  for (int run = 1; run <= NumFaultRuns(); ++run) {
    BeginRun(line, Tier::kShared);
    run_once(run);
  }
}

void FaultTest::MakeStore() {
  if (tier_ == Tier::kEmbedded) MoveTo({});
  if (tier_ == Tier::kShared) {
    postgres_ = std::make_unique<store::PostgresServer>();
    s3_ = std::make_unique<store::FakeS3>();
    catalog_url_ = postgres_->NewUrl();
    std::vector<std::string> environment = s3_environment_;
    environment.push_back("AWS_ENDPOINT_URL=" + s3_->endpoint());
    MoveTo({catalog_url_, "s3://bucket", environment});
  }
  Process server = StartServer();
  Process worker = StartFaultWorker();
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
  ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  ExpectSuccess(AwaitDone(ImportBall(kImported, kImportVelocity).name()));
  Operation registration;
  ASSERT_TRUE(Register(*stub_, "first", registration).ok());
  ExpectSuccess(AwaitDone(registration.name()));
  expected_ = {catalog().GetFamily("balls")->blob(), catalog().GetAnimation(kImported)->blob(),
               FrameOf("balls")};
  num_versions_ = 1;
  ForgetImport();
  for (Process* process : {&worker, &server}) process->Signal(SIGTERM);
  EXPECT_EQ(worker.Wait(), 0);
  EXPECT_EQ(server.Wait(), 0);
  catalog_.reset();
  if (tier_ == Tier::kEmbedded) TakeTemplate();
}

void FaultTest::TakeTemplate() {
  template_ = std::make_unique<store::TemporaryFolder>();
  fs::copy(data(), template_->path(), fs::copy_options::recursive);
}

Process FaultTest::StartFaultWorker(const std::vector<std::string>& environment) {
  std::vector<std::string> arguments = StoreArguments();
  arguments.insert(arguments.end(), {"--lease", absl::FormatDuration(WorkerLease()), "--poll",
                                     "20ms", "--threads", "1"});
  std::vector<std::string> all = environment;
  all.push_back("LIQUIDBLEND_CHECKPOINT_INTERVAL=1ms");
  all.push_back("LIQUIDBLEND_CHECKPOINT_ITERATIONS=1");
  return Process("liquidblend-worker", arguments, WithStore(all));
}

bool FaultTest::SubmitWork() {
  const bool is_import_accepted = Submit(kImport);
  return Submit(kRegistration) && is_import_accepted;
}

bool FaultTest::Submit(const std::string& what) {
  if (names_.count(what) > 0) return true;
  Operation operation;
  const grpc::Status status =
      what == kImport ? Upload(kImported, BallFiles(kImportVelocity), RequestId(what), operation)
                      : Register(*stub_, what, operation);
  if (status.ok()) {
    NoteAccepted(what, operation);
  } else {
    errors_.push_back(status.error_message());
  }
  return status.ok();
}

grpc::Status FaultTest::Register(v1::LiquidBlend::Stub& stub, const std::string& what,
                                 Operation& operation) const {
  v1::RegisterFamilyRequest request;
  request.set_family_id("balls");
  request.set_source("animations/a");
  request.add_targets("animations/b");
  request.set_request_id(RequestId(what));
  request.set_replace(true);
  *request.mutable_options() = options_;
  grpc::ClientContext context;
  SetDeadline(context);
  return stub.RegisterFamily(&context, request, &operation);
}

void FaultTest::RegisterUntilAccepted(v1::LiquidBlend::Stub& stub, const std::string& what) {
  Operation operation;
  Await([&] { return Register(stub, what, operation).ok(); });
  NoteAccepted(what, operation);
}

void FaultTest::NoteAccepted(const std::string& what, const Operation& operation) {
  const absl::MutexLock lock(&names_mutex_);
  names_[what] = operation.name();
  ++line_->num_accepted;
}

std::string FaultTest::RequestId(const std::string& what) const {
  return absl::StrCat(what, " of run ", run_);
}

void FaultTest::TakeTime() {
  options_ = LongWork();
  options_.set_max_iterations(120);  // of many jobs
}

JobRecord FaultTest::JobOf(const std::string& operation) {
  const auto job = catalog().GetJob(operation.substr(std::string("operations/").size()));
  return job.ok() ? *job : JobRecord();
}

store::Catalog& FaultTest::catalog() {
  if (catalog_ == nullptr) {
    auto opened = tier_ == Tier::kEmbedded ? store::OpenSqliteCatalog(store::CatalogPath(data()))
                                           : store::OpenPostgresCatalog(catalog_url_);
    if (!opened.ok()) {
      ADD_FAILURE() << opened.status();
      std::abort();
    }
    catalog_ = *std::move(opened);
  }
  return *catalog_;
}

void FaultTest::AwaitMidJob() {
  Await([&] {
    const JobRecord job = JobOf(registration());
    return job.state() == JobRecord::RUNNING && !job.checkpoint_blob().empty();
  });
}

void FaultTest::Lose(const std::string& what) {
  line_->lost.push_back(absl::StrCat("run ", run_, ": ", what));
}

void FaultTest::EndRun(Process server, Process worker, const std::function<void()>& when_done) {
  if (server.pid() == 0) server = StartServer();
  Await([&] { return Submit(kImport); });
  const auto is_registration = [](const auto& name) {
    return name.first.find(kRegistration) != std::string::npos;
  };
  if (std::none_of(names_.begin(), names_.end(), is_registration)) {
    Await([&] { return Submit(kRegistration); });
  }
  num_versions_ += std::count_if(names_.begin(), names_.end(), is_registration);
  AwaitAll(worker);
  if (when_done) when_done();
  CheckPublished();
  if (tier_ == Tier::kShared) ForgetImport();
}

bool FaultTest::AwaitDeath(const Process& program) {
  const auto lingers = Slowness() * std::chrono::seconds(3);  // after the last job
  const auto all_done = [this] {
    return std::all_of(names_.begin(), names_.end(),
                       [this](const auto& name) { return IsDone(name.first, name.second); });
  };
  auto end = std::chrono::steady_clock::time_point::max();
  while (IsAlive(program.pid())) {
    const auto now = std::chrono::steady_clock::now();
    if (now > end) return false;
    if (end == std::chrono::steady_clock::time_point::max() && all_done()) end = now + lingers;
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

void FaultTest::AwaitAll(Process& worker) {
  const auto deadline = std::chrono::steady_clock::now() + Patience();
  for (const auto& [what, operation] : names_) {
    while (!IsDone(what, operation)) {
      if (worker.pid() == 0 || !IsAlive(worker.pid())) worker = StartFaultWorker();
      if (std::chrono::steady_clock::now() > deadline) {
        return Lose(absl::StrCat(what, " is not done: ", JobOf(operation).ShortDebugString()));
      }
      std::this_thread::sleep_for(kPoll);
    }
    const JobRecord job = JobOf(operation);
    for (const auto& attempt : job.failed_attempts()) {
      ++line_->num_retried;
      if (!attempt.worker_lost()) errors_.push_back(attempt.error().message());
    }
  }
}

bool FaultTest::IsDone(const std::string& what, const std::string& operation) {
  grpc::ClientContext context;
  SetDeadline(context);
  google::longrunning::GetOperationRequest request;
  request.set_name(operation);
  Operation found;
  const grpc::Status status = operations_->GetOperation(&context, request, &found);
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
    Lose(absl::StrCat(what, " is not there any more"));
    return true;
  }
  if (!status.ok() || !found.done()) return false;
  if (!found.has_response()) Lose(absl::StrCat(what, " failed: ", found.error().message()));
  return true;
}

void FaultTest::CheckPublished() {
  const auto family = catalog().GetFamily("balls");
  if (!family.ok() || family->blob() != expected_.family_blob) Lose("the family has other bytes");
  if (!family.ok() || family->version() != num_versions_) {
    Lose(absl::StrCat("the family has version ", family.ok() ? family->version() : 0, ", not ",
                      num_versions_));
  }
  const auto animation = catalog().GetAnimation(kImported);
  if (!animation.ok() || animation->blob() != expected_.import_blob) {
    Lose("the animation has other bytes");
  }
  if (FrameOf("balls") != expected_.frame) Lose("a frame has other bytes");
  if (Admin({"check"}) != 0) Lose("liquidblend-admin check found damage");
  line_->num_published += 4;
}

void FaultTest::ForgetImport() {
  grpc::ClientContext context;
  SetDeadline(context);
  v1::DeleteAnimationRequest request;
  request.set_name(std::string("animations/") + kImported);
  google::protobuf::Empty empty;
  EXPECT_TRUE(stub_->DeleteAnimation(&context, request, &empty).ok());
  EXPECT_EQ(Admin({"collect", "--older-than", "0s"}), 0);
}

int FaultTest::Admin(std::vector<std::string> arguments) const {
  for (const std::string& argument : StoreArguments()) arguments.push_back(argument);
  return Process("liquidblend-admin", arguments, WithStore()).Wait();
}

std::string FaultTest::FrameOf(const std::string& family) {
  grpc::ClientContext context;
  SetDeadline(context);
  v1::GetFrameRequest request;
  request.set_family("families/" + family);
  request.add_weights(0.5);
  request.set_time_s(0.05);
  v1::Frame frame;
  const grpc::Status status = stub_->GetFrame(&context, request, &frame);
  return status.ok() ? frame.data() : status.error_message();
}

FaultLayer& FaultTest::MakeLayer(bool has_disk) {
  layer_.reset();
  own_ = std::make_unique<store::TemporaryFolder>();
  layer_ = std::make_unique<FaultLayer>(data(), own_->path(), has_disk);
  return *layer_;
}

}  // namespace liquidblend::e2e
