#include "worker/jobs/checkpoint_file.h"

#include "liquidblend/store/v1/files.pb.h"
#include "tests/core/store/files/file_testing.h"

namespace liquidblend::jobs {
namespace {

using registration::CompetitionState;
using registration::IterationState;
using registration::RegistrationState;
using registration::SharpenState;
using store::Fails;
using store::MemoryBlob;
using store::MemoryWriter;
using store::Succeeds;
using Code = absl::StatusCode;
using Manifest = store::v1::CheckpointManifest;

IterationState ThirdIteration() {
  IterationState state;
  state.last = {3, 16, 1.5, 2.5, 90, 100};
  state.maps.resize(2);
  state.maps[1][19] = 0.1f;
  state.draws = {{10, 11}, {12, 13}, {14, 15}};
  state.worst = {7, 3, 5};
  state.seconds = 8.25;
  return state;
}

SharpenState SecondRound() {
  SharpenState state;
  state.num_rounds = 2;
  state.num_finer_nodes = 40;
  state.displacement = Eigen::Matrix4Xf::Constant(4, 5, 0.3f);
  state.coarse_edge_length_m = 0.7;
  state.coarse_report.num_nodes = 9;
  state.coarse_report.num_iterations = 16;
  state.coarse_report.verdict.fit_energy = 3.0;
  mesh::CorrespondenceReport& found = state.coarse_report.correspondences.emplace_back();
  found.correspondence.source = {1, 2, 3, 3.7};
  found.automatic = true;
  found.confidence = 0.9;
  state.seconds = 4.5;
  return state;
}

CompetitionState SecondPairing() {
  CompetitionState state;
  state.tried = {{"the pairs of features of least cost", 3.5, false}};
  state.best = ThirdIteration();
  state.best.last.iteration = 16;
  state.next = ThirdIteration();
  state.next->maps.resize(3);
  state.next->worst = {1, 2};
  return state;
}

std::string Bytes(const RegistrationState& state, int64_t number = 6) {
  MemoryWriter writer;
  EXPECT_THAT(WriteCheckpoint({"print", "lease", number}, state, writer), Succeeds());
  return writer.content;
}

absl::StatusOr<Checkpoint> Read(const std::string& bytes) {
  const MemoryBlob blob(bytes);
  return ReadCheckpoint(blob, "c.lbckp");
}

TEST(CheckpointFile, GivesBackTheStateBetweenIterations) {
  const IterationState before = ThirdIteration();
  const auto read = Read(Bytes(before));
  ASSERT_THAT(read, Succeeds());
  EXPECT_EQ(read->label.fingerprint, "print");
  EXPECT_EQ(read->label.lease, "lease");
  EXPECT_EQ(read->label.number, 6);
  const IterationState& after = std::get<IterationState>(read->state);
  EXPECT_EQ(after.last.iteration, 3);
  EXPECT_EQ(after.last.num_samples, 100);
  EXPECT_EQ(after.maps, before.maps);
  EXPECT_EQ(after.worst, before.worst);
  ASSERT_EQ(after.draws.size(), 3u);
  EXPECT_EQ(after.draws[2].num_target, 15);
  EXPECT_EQ(Bytes(after), Bytes(before));
}

TEST(CheckpointFile, GivesBackTheStateBetweenRoundsOfFinerNodes) {
  const SharpenState before = SecondRound();
  const auto read = Read(Bytes(before));
  ASSERT_THAT(read, Succeeds());
  const SharpenState& after = std::get<SharpenState>(read->state);
  EXPECT_EQ(after.num_rounds, 2);
  EXPECT_EQ(after.displacement, before.displacement);
  EXPECT_EQ(after.coarse_report.correspondences[0].correspondence.source[3], 3.7);
  EXPECT_EQ(Bytes(after), Bytes(before));
}

TEST(CheckpointFile, GivesBackTheStateOfOtherPairings) {
  CompetitionState before = SecondPairing();
  for (const bool has_begun : {true, false}) {
    if (!has_begun) before.next.reset();
    const auto read = Read(Bytes(before));
    ASSERT_THAT(read, Succeeds());
    const CompetitionState& after = std::get<CompetitionState>(read->state);
    ASSERT_EQ(after.tried.size(), 1u);
    EXPECT_EQ(after.tried[0].pairing, before.tried[0].pairing);
    EXPECT_EQ(after.tried[0].cost, 3.5);
    EXPECT_EQ(after.best.last.iteration, 16);
    EXPECT_EQ(after.best.last.num_samples, 100);
    EXPECT_EQ(after.best.maps, before.best.maps);
    EXPECT_EQ(after.best.seconds, 8.25);
    ASSERT_EQ(after.next.has_value(), has_begun);
    if (has_begun) {
      EXPECT_EQ(after.next->last.iteration, 3);
      EXPECT_EQ(after.next->maps.size(), 3u);
      EXPECT_EQ(after.next->worst, before.next->worst);
    }
    EXPECT_EQ(Bytes(after), Bytes(before));
  }
}

// Files of before have the same bytes; programs of before refuse others by their version.
TEST(CheckpointFile, OnlyOneOfOtherPairingsHasTheNewVersion) {
  constexpr size_t kVersionAt = 16;
  EXPECT_EQ(Bytes(ThirdIteration())[kVersionAt], 1);
  EXPECT_EQ(Bytes(SecondRound())[kVersionAt], 1);
  EXPECT_EQ(Bytes(SecondPairing())[kVersionAt], 2);
}

TEST(CheckpointFile, NoTwoHaveTheSameBytes) {
  EXPECT_NE(Bytes(ThirdIteration(), 1), Bytes(ThirdIteration(), 2));
}

TEST(CheckpointFile, AnyChangedByteIsNoticed) {
  for (const RegistrationState& state :
       {RegistrationState(ThirdIteration()), RegistrationState(SecondPairing())}) {
    const std::string whole = Bytes(state);
    for (size_t k = 0; k < whole.size(); ++k) {
      std::string changed = whole;
      changed[k] = static_cast<char>(changed[k] ^ 0x10);
      EXPECT_FALSE(Read(changed).ok()) << "byte " << k;
    }
  }
}

TEST(CheckpointFile, AnyOtherLengthIsNoticed) {
  const std::string whole = Bytes(SecondRound());
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(Read(whole.substr(0, size)).ok()) << size;
  }
  EXPECT_THAT(Read(whole + '\0'), Fails(Code::kDataLoss, "c.lbckp"));
}

TEST(CheckpointFile, NamesWhatContradictsItself) {
  const auto changed = [](const std::function<void(Manifest&)>& change) {
    return Read(store::WithManifest<Manifest>(Bytes(SecondRound()), change));
  };
  EXPECT_THAT(changed([](Manifest& manifest) { manifest.mutable_sections()->RemoveLast(); }),
              Fails(Code::kInvalidArgument, "3 sections instead of 4"));
  EXPECT_THAT(changed([](Manifest& manifest) {
                manifest.mutable_finer_nodes()
                    ->mutable_coarse_report()
                    ->mutable_correspondences(0)
                    ->mutable_correspondence()
                    ->clear_target();
              }),
              Fails(Code::kInvalidArgument, "four numbers"));
  EXPECT_THAT(changed([](Manifest& manifest) { manifest.mutable_competition(); }),
              Fails(Code::kInvalidArgument, "has other pairings, in version 1"));
  const auto changed_pairing = [](const std::function<void(Manifest&)>& change) {
    return Read(store::WithManifest<Manifest>(Bytes(SecondPairing()), change));
  };
  EXPECT_THAT(changed_pairing([](Manifest& manifest) { manifest.clear_competition(); }),
              Fails(Code::kInvalidArgument, "has no other pairings, in version 2"));
  EXPECT_THAT(changed_pairing([](Manifest& manifest) { manifest.mutable_finer_nodes(); }),
              Fails(Code::kInvalidArgument, "has finer nodes and other pairings"));
  EXPECT_THAT(
      changed_pairing([](Manifest& manifest) { manifest.mutable_sections()->RemoveLast(); }),
      Fails(Code::kInvalidArgument, "6 sections instead of 7"));
  EXPECT_THAT(Read("no checkpoint at all"), Fails(Code::kInvalidArgument, "c.lbckp"));
}

}  // namespace
}  // namespace liquidblend::jobs
