#include <limits>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "core/store/files/files.h"
#include "tests/core/store/files/file_testing.h"

namespace liquidblend::store::family_file_test {
namespace {

using Code = absl::StatusCode;
using Manifest = v1::FamilyManifest;

// A small family with one cell of each kind and two targets, and what it views.
struct Sample {
  std::vector<mesh::Float4> vertices;
  std::vector<mesh::Tetrahedron> tetrahedra = {{0, 1, 2, 3}, {1, 2, 3, 4}};
  std::vector<mesh::Pyramid> pyramids = {{1, 2, 3, 4, 5}};
  std::vector<mesh::Wedge> wedges = {{2, 3, 4, 5, 6, 7}};
  std::vector<mesh::Hexahedron> hexahedra = {{2, 3, 4, 5, 6, 7, 8, 9}};
  std::vector<mesh::Float4> displacement = {10, mesh::Float4{0.1f, 0.2f, 0.3f, 1.0f}};
  std::vector<mesh::Float4> extrapolation = {10, mesh::Float4{0.1f, 0.1f, 0.1f, 0.5f}};
  std::vector<mesh::Float3> velocities = {10, mesh::Float3{1.5f, -2.0f, 3.0f}};

  Sample() {
    for (int v = 0; v < 10; ++v) vertices.push_back({0.1f * float(v), 0.0f, 0.0f, float(v) - 0.5f});
  }

  mesh::RegisteredFamily View() const {
    mesh::RegisteredFamily family;
    family.name = "walls";
    family.version = 4;
    family.source = "thin";
    family.vertices = vertices;
    family.tetrahedra = tetrahedra;
    family.pyramids = pyramids;
    family.wedges = wedges;
    family.hexahedra = hexahedra;
    family.targets = {{"thick", displacement, extrapolation, {120, 16, 0.08, 0.97, 14.5, {}, {}}},
                      {"none", displacement, {}, mesh::RegistrationReport()}};
    family.targets[0].report.verdict = DoubtfulVerdict(4.5);
    mesh::SpaceTimeReport report;
    report.grid_spacing_m = 0.1125;
    report.edge_length_m = 0.125;
    report.num_vertices = 10;
    report.num_tetrahedra = 2;
    report.num_pyramids = 3;
    report.num_wedges = 4;
    report.num_hexahedra = 5;
    report.num_droplets = 6;
    report.num_rigid_pieces = 7;
    report.thin_share = 0.25;
    report.fidelity = {16, 0.03, 0.5, 0.001, 40, 41, 1};
    family.space_time_reports = {report, {}, {}};
    family.space_time_reports[2].is_tracked = true;
    family.parameter_space = {{"width", "height"}, {{0.5, 20}, {1, 20}, {0.5, 60}}};
    family.num_first_vertices = 1;
    family.num_last_vertices = 1;
    family.num_frames = 9;
    family.frames_per_second = 30.0;
    family.edge_length_m = 0.125;
    family.domain_min = {-1, -2, -3};
    family.domain_max = {1, 2, 3};
    return family;
  }

  // With velocities, and itself as a coarser level with fewer cells.
  mesh::RegisteredFamily Complete() const {
    mesh::RegisteredFamily family = View();
    family.velocities = velocities;
    mesh::RegisteredFamily level = family;
    level.tetrahedra = {};
    level.wedges = {};
    family.coarser_levels = {level};
    return family;
  }
};

std::string Written(const mesh::RegisteredFamily& family) {
  MemoryWriter writer;
  EXPECT_THAT(WriteFamily(family, writer), Succeeds());
  return writer.content;
}

std::string Whole() {
  const Sample sample;
  return Written(sample.View());
}

absl::StatusOr<mesh::RegisteredFamily> Open(const std::string& content) {
  return OpenFamily(std::make_shared<MemoryBlob>(content), "f.lbfam");
}

std::string Changed(const std::function<void(Manifest&)>& change) {
  return WithManifest<Manifest>(Whole(), change);
}

template <typename T>
std::vector<T> Copy(std::span<const T> span) {
  return {span.begin(), span.end()};
}

TEST(FamilyFile, GivesBackTheFamily) {
  const Sample sample;
  const auto family = Open(Whole());
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(family->name, "walls");
  EXPECT_EQ(family->version, 0);  // the catalog assigns it
  EXPECT_EQ(family->source, "thin");
  EXPECT_EQ(Copy(family->vertices), sample.vertices);
  EXPECT_EQ(Copy(family->tetrahedra), sample.tetrahedra);
  EXPECT_EQ(Copy(family->pyramids), sample.pyramids);
  EXPECT_EQ(Copy(family->wedges), sample.wedges);
  EXPECT_EQ(Copy(family->hexahedra), sample.hexahedra);
  ASSERT_EQ(family->targets.size(), 2);
  EXPECT_EQ(family->targets[0].name, "thick");
  EXPECT_EQ(Copy(family->targets[0].displacement), sample.displacement);
  EXPECT_EQ(Copy(family->targets[0].extrapolation), sample.extrapolation);
  EXPECT_EQ(family->targets[0].report.num_nodes, 120);
  EXPECT_EQ(family->targets[0].report.num_iterations, 16);
  EXPECT_EQ(family->targets[0].report.mean_residual_edges, 0.08);
  EXPECT_EQ(family->targets[0].report.inlier_share, 0.97);
  EXPECT_EQ(family->targets[1].name, "none");
  EXPECT_TRUE(family->targets[1].extrapolation.empty());
  EXPECT_EQ(family->num_first_vertices, 1);
  EXPECT_EQ(family->num_last_vertices, 1);
  EXPECT_EQ(family->num_frames, 9);
  EXPECT_EQ(family->frames_per_second, 30.0);
  EXPECT_EQ(family->edge_length_m, 0.125);
  EXPECT_EQ(family->domain_min, (std::array<float, 3>{-1, -2, -3}));
  EXPECT_EQ(family->domain_max, (std::array<float, 3>{1, 2, 3}));
}

// The same family gives the same blob id as in programs of before: this changes with the format.
TEST(FamilyFile, HasTheSameBytesAsEver) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.Complete();
  mesh::CorrespondenceReport& report = family.targets[0].report.correspondences.emplace_back();
  report.correspondence.kind = mesh::CorrespondenceKind::kSpace;
  report.correspondence.source = {1, 2, 3, 6};
  report.correspondence.target = {4, 5, 6, 3};
  report.kept = false;
  report.automatic = true;
  report.confidence = 0.5;
  family.rest_time_s = -0.5;
  family.up = mesh::Up::kY;
  EXPECT_EQ(HashOf(Written(family)), "xxh3-7544f0c981d44c60ae966c0c3f748f19");
  EXPECT_EQ(HashOf(Whole()), "xxh3-084fa98971e79dce1fe652e6095deaac");
}

TEST(FamilyFile, GivesBackThePointsInParameterSpace) {
  const auto family = Open(Whole());
  ASSERT_THAT(family, Succeeds());
  EXPECT_THAT(family->parameter_space.names, testing::ElementsAre("width", "height"));
  EXPECT_EQ(family->parameter_space.points, Sample().View().parameter_space.points);
  const Sample sample;
  mesh::RegisteredFamily plain = sample.View();
  plain.parameter_space = {};
  const auto without = Open(Written(plain));
  ASSERT_THAT(without, Succeeds());
  EXPECT_TRUE(without->parameter_space.empty());
}

TEST(FamilyFile, GivesBackTheInterpolationOfPoints) {
  EXPECT_EQ(Open(Whole())->parameter_space.interpolation, mesh::Interpolation::kLinear);
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  EXPECT_EQ(ManifestOf(family).parameter_space().interpolation(),
            v1::ParameterSpace::INTERPOLATION_UNSPECIFIED);
  family.parameter_space.interpolation = mesh::Interpolation::kSmooth;
  const auto smooth = Open(Written(family));
  ASSERT_THAT(smooth, Succeeds());
  EXPECT_EQ(smooth->parameter_space.interpolation, mesh::Interpolation::kSmooth);
  EXPECT_THAT(Open(Changed([](Manifest& m) {
                m.mutable_parameter_space()->set_interpolation(v1::ParameterSpace::LINEAR);
              }))->parameter_space.interpolation,
              mesh::Interpolation::kLinear);
  EXPECT_THAT(Open(Changed([](Manifest& m) {
                m.mutable_parameter_space()->set_interpolation(
                    static_cast<v1::ParameterSpace::Interpolation>(7));
              })),
              Fails(Code::kInvalidArgument, "interpolation 7 is neither linear nor smooth"));
}

TEST(FamilyFile, RefusesPointsThatDoNotFit) {
  EXPECT_THAT(Open(Changed([](Manifest& m) {
                m.mutable_parameter_space()->mutable_points()->RemoveLast();
              })),
              Fails(Code::kInvalidArgument, "2 points for 3 animations"));
}

TEST(FamilyFile, GivesBackFiguresThatOlderFilesLack) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  family.time_blending_reason = "b: it falls";
  family.targets[0].report.rest = {true, -2.5, "it falls"};
  family.targets[0].report.part_lives = {{{1, 2, 3}, 12.5, 20}};
  family.targets[0].report.hypotheses = {{"these pairs", 4, false}, {"no pairs", 1.5, true}};
  const auto opened = Open(Written(family));
  ASSERT_THAT(opened, Succeeds());
  EXPECT_EQ(opened->time_blending_reason, "b: it falls");
  EXPECT_TRUE(opened->targets[0].report.rest.is_from_rest);
  EXPECT_EQ(opened->targets[0].report.rest.time_frames, -2.5);
  EXPECT_EQ(opened->targets[0].report.rest.reason, "it falls");
  ASSERT_EQ(opened->targets[0].report.part_lives.size(), 1U);
  const mesh::PartLife& life = opened->targets[0].report.part_lives[0];
  EXPECT_THAT(life.source_start_m, testing::ElementsAre(1, 2, 3));
  EXPECT_EQ(life.source_end_frames, 12.5);
  EXPECT_EQ(life.target_end_frames, 20);
  ASSERT_EQ(opened->targets[0].report.hypotheses.size(), 2U);
  EXPECT_EQ(opened->targets[0].report.hypotheses[0].pairing, "these pairs");
  EXPECT_FALSE(opened->targets[0].report.hypotheses[0].is_kept);
  EXPECT_EQ(opened->targets[0].report.hypotheses[1].cost, 1.5);
  EXPECT_TRUE(opened->targets[0].report.hypotheses[1].is_kept);
  EXPECT_EQ(opened->targets[1].report.rest.reason, "");
  EXPECT_THAT(opened->targets[1].report.part_lives, testing::IsEmpty());
}

TEST(FamilyFile, GivesBackTheReportsOfTheSpaceTimeMeshes) {
  const auto family = Open(Whole());
  ASSERT_THAT(family, Succeeds());
  ASSERT_EQ(family->space_time_reports.size(), 3U);
  const mesh::SpaceTimeReport& report = family->space_time_reports[0];
  EXPECT_FALSE(report.is_tracked);
  EXPECT_EQ(report.grid_spacing_m, 0.1125);
  EXPECT_EQ(report.edge_length_m, 0.125);
  EXPECT_EQ(report.num_vertices, 10);
  EXPECT_EQ(report.num_tetrahedra, 2);
  EXPECT_EQ(report.num_pyramids, 3);
  EXPECT_EQ(report.num_wedges, 4);
  EXPECT_EQ(report.num_hexahedra, 5);
  EXPECT_EQ(report.num_droplets, 6);
  EXPECT_EQ(report.num_rigid_pieces, 7);
  EXPECT_EQ(report.thin_share, 0.25);
  EXPECT_EQ(report.fidelity.num_frames, 16);
  EXPECT_EQ(report.fidelity.mean_distance_edges, 0.03);
  EXPECT_EQ(report.fidelity.max_distance_edges, 0.5);
  EXPECT_EQ(report.fidelity.max_volume_error, 0.001);
  EXPECT_EQ(report.fidelity.num_components, 40);
  EXPECT_EQ(report.fidelity.num_components_shown, 41);
  EXPECT_EQ(report.fidelity.max_component_error, 1);
  EXPECT_TRUE(family->space_time_reports[2].is_tracked);
}

// Each figure of a verdict by its name; a number as a list of one.
std::map<std::string, std::vector<double>> FiguresOf(const mesh::Verdict& verdict) {
  std::map<std::string, std::vector<double>> figures;
  mesh::Verdict::ForEachFigure(verdict, [&](const char* name, const auto& figure) {
    if constexpr (std::is_same_v<decltype(figure), const double&>) {
      figures[name] = {figure};
    } else {
      figures[name].assign(figure.begin(), figure.end());
    }
  });
  return figures;
}

TEST(FamilyFile, GivesBackTheVerdicts) {
  const Sample sample;
  const auto family = Open(Whole());
  ASSERT_THAT(family, Succeeds());
  const mesh::Verdict& verdict = family->targets[0].report.verdict;
  const mesh::FamilyTarget written = sample.View().targets[0];
  const mesh::Verdict& expected = written.report.verdict;
  EXPECT_EQ(verdict.grade, mesh::Grade::kDoubtful);
  EXPECT_EQ(verdict.reason, expected.reason);
  EXPECT_EQ(verdict.worst, expected.worst);
  EXPECT_EQ(FiguresOf(verdict), FiguresOf(expected));
  EXPECT_EQ(family->targets[1].report.verdict.grade, mesh::Grade::kUnknown);
}

TEST(FamilyFile, GivesBackEachFigureOfAVerdict) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  mesh::Verdict& verdict = family.targets[0].report.verdict;
  verdict.volume_errors.resize(2);
  double value = 0;  // of each figure another one
  mesh::Verdict::ForEachFigure(verdict, [&](const char*, auto& figure) {
    if constexpr (std::is_same_v<decltype(figure), double&>) {
      figure = ++value;
    } else {
      for (double& x : figure) x = ++value;
    }
  });
  const auto opened = Open(Written(family));
  ASSERT_THAT(opened, Succeeds());
  EXPECT_EQ(FiguresOf(opened->targets[0].report.verdict), FiguresOf(verdict));
}

TEST(FamilyFile, DoesNotBelieveAnUnknownGrade) {
  const auto family = Open(Changed([](Manifest& manifest) {
    manifest.mutable_reports(0)->mutable_verdict()->set_grade(static_cast<v1::Grade>(77));
  }));
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(family->targets[0].report.verdict.grade, mesh::Grade::kUnknown);
}

TEST(FamilyFile, HasAReportPerAnimationOrNoneAsInOlderFiles) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  family.space_time_reports.pop_back();
  EXPECT_THAT(Open(Written(family)),
              Fails(Code::kInvalidArgument, "2 reports of space-time meshes for 3 animations"));
  family.space_time_reports.clear();
  const auto old = Open(Written(family));
  ASSERT_THAT(old, Succeeds());
  EXPECT_TRUE(old->space_time_reports.empty());
}

TEST(FamilyFile, GivesBackReportsOnCorrespondences) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  mesh::CorrespondenceReport report;
  report.correspondence = {
      mesh::CorrespondenceKind::kTrajectory, false, {1, 2, 3, 6}, {-1, -2, -3, 3}, 4.5};
  report.num_nodes = 2;
  report.residual_m = 0.25;
  report.residual_frames = 1.5;
  report.kept = false;
  report.automatic = true;
  report.confidence = 0.75;
  family.targets[1].report.correspondences = {report};
  const std::string content = Written(family);
  const auto read = Open(content);
  ASSERT_THAT(read, Succeeds());
  EXPECT_TRUE(read->targets[0].report.correspondences.empty());
  ASSERT_EQ(read->targets[1].report.correspondences.size(), 1U);
  const mesh::CorrespondenceReport& same = read->targets[1].report.correspondences[0];
  EXPECT_EQ(same.correspondence, report.correspondence);
  EXPECT_EQ(same.num_nodes, 2);
  EXPECT_EQ(same.residual_m, 0.25);
  EXPECT_EQ(same.residual_frames, 1.5);
  EXPECT_FALSE(same.kept);
  EXPECT_TRUE(same.automatic);
  EXPECT_EQ(same.confidence, 0.75);
  const std::string broken = WithManifest<Manifest>(content, [](Manifest& m) {
    m.mutable_reports(1)
        ->mutable_correspondences(0)
        ->mutable_correspondence()
        ->mutable_source()
        ->RemoveLast();
  });
  EXPECT_THAT(Open(broken), Fails(Code::kInvalidArgument, "not four numbers"));
}

TEST(FamilyFile, GivesBackVelocitiesAndLevels) {
  const Sample sample;
  const auto family = Open(Written(sample.Complete()));
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(Copy(family->velocities), sample.velocities);
  ASSERT_EQ(family->coarser_levels.size(), 1U);
  const mesh::RegisteredFamily& level = family->coarser_levels[0];
  EXPECT_EQ(Copy(level.vertices), sample.vertices);
  EXPECT_EQ(Copy(level.velocities), sample.velocities);
  EXPECT_EQ(level.num_cells(), 2);
  EXPECT_EQ(Copy(level.hexahedra), sample.hexahedra);
  EXPECT_EQ(level.num_frames, 9);
  EXPECT_EQ(level.num_last_vertices, 1);
  ASSERT_EQ(level.targets.size(), 2U);
  EXPECT_EQ(Copy(level.targets[0].extrapolation), sample.extrapolation);
  const Manifest manifest = ManifestOf(*family);
  EXPECT_TRUE(manifest.has_velocities());
  EXPECT_EQ(manifest.coarser_levels(0).num_vertices(), 10);
  EXPECT_EQ(manifest.coarser_levels(0).num_cells(), 2);
}

TEST(FamilyFile, IsOfTheLowestVersionThatCanHoldIt) {
  const Sample sample;
  constexpr size_t kVersion = 16;  // its place in the header
  EXPECT_EQ(Whole()[kVersion], 1);
  EXPECT_EQ(Written(sample.Complete())[kVersion], 2);
  mesh::RegisteredFamily squares = sample.View();
  squares.rest_time_s = 0;
  EXPECT_EQ(Written(squares)[kVersion], 3);
}

TEST(FamilyFile, GivesBackThePreRollOfAllLevels) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.Complete();
  EXPECT_EQ(Open(Written(family))->num_pre_roll, 0);
  family.num_pre_roll = 8;
  const auto opened = Open(Written(family));
  ASSERT_THAT(opened, Succeeds());
  EXPECT_EQ(opened->num_pre_roll, 8);
  EXPECT_EQ(opened->coarser_levels[0].num_pre_roll, 8);
}

TEST(FamilyFile, GivesBackTheRestTimeOfAllLevels) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.Complete();
  EXPECT_FALSE(Open(Written(family))->rest_time_s.has_value());
  family.rest_time_s = family.coarser_levels[0].rest_time_s = -0.25;
  const auto opened = Open(Written(family));
  ASSERT_THAT(opened, Succeeds());
  EXPECT_EQ(opened->rest_time_s, -0.25);
  EXPECT_EQ(opened->coarser_levels[0].rest_time_s, -0.25);
  EXPECT_EQ(Copy(opened->vertices), sample.vertices);
}

// Older files say nothing.
TEST(FamilyFile, KeepsWhatIsUp) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  EXPECT_EQ(Open(Written(family))->up, mesh::Up::kUnknown);
  family.up = mesh::Up::kX;
  EXPECT_EQ(Open(Written(family))->up, mesh::Up::kX);
  EXPECT_EQ(ManifestOf(family).up(), v1::UP_X);
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.set_up(static_cast<v1::Up>(-1)); })),
              Fails(Code::kInvalidArgument, "up = -1"));
}

TEST(FamilyFile, RefusesARestTimeThatCannotBeMeant) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  family.rest_time_s = 1;
  EXPECT_THAT(Open(Written(family)), Fails(Code::kInvalidArgument, "rest_time_s = 1"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.set_rest_time_s(0); })),
              Fails(Code::kInvalidArgument, "has a rest time, in version 1"));
  family.rest_time_s = 0;
  EXPECT_THAT(
      Open(WithManifest<Manifest>(Written(family), [](Manifest& m) { m.clear_rest_time_s(); })),
      Fails(Code::kInvalidArgument, "has no rest time, in version 3"));
}

TEST(FamilyFile, NoticesEachByteThatChangesInALevel) {
  const std::string whole = Written(Sample().Complete());
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0x41);
    EXPECT_FALSE(Open(changed).ok()) << i;
  }
}

TEST(FamilyFile, RefusesLevelsAndVelocitiesThatDoNotFit) {
  const auto with = [](const std::function<void(mesh::RegisteredFamily&)>& change) {
    const Sample sample;
    mesh::RegisteredFamily family = sample.Complete();
    change(family);
    return Open(Written(family)).status();
  };
  EXPECT_THAT(with([](auto& f) { f.velocities = f.velocities.first(3); }),
              Fails(Code::kInvalidArgument, "3 velocities for 10 vertices"));
  EXPECT_THAT(with([](auto& f) { f.coarser_levels[0].vertices = f.vertices.first(4); }),
              Fails(Code::kInvalidArgument, "level of detail 1: family walls: "));
  const std::string whole = Written(Sample().Complete());
  EXPECT_THAT(Open(WithManifest<Manifest>(
                  whole, [](Manifest& m) { m.mutable_coarser_levels(0)->set_num_cells(3); })),
              Fails(Code::kInvalidArgument, "level of detail 1 has 10 vertices and 2 cells, not"));
  EXPECT_THAT(Open(WithManifest<Manifest>(whole, [](Manifest& m) { m.clear_coarser_levels(); })),
              Fails(Code::kInvalidArgument, "20 sections for 2 targets and 0 coarser"));
}

// A level takes 14 bytes of a file and, in memory, a copy of the family's names.
TEST(FamilyFile, RefusesMoreLevelsThanAreEverMade) {
  const auto with_levels = [](int num_levels) {
    return Open(WithManifest<Manifest>(Written(Sample().Complete()), [&](Manifest& m) {
      while (m.coarser_levels_size() < num_levels) m.add_coarser_levels();
      while (m.sections_size() < 10 * (1 + num_levels)) m.add_sections();
    }));
  };
  EXPECT_THAT(with_levels(6), Fails(Code::kInvalidArgument, "section"));
  EXPECT_THAT(with_levels(7), Fails(Code::kInvalidArgument, "7 coarser levels, more than 6"));
}

TEST(FamilyFile, ViewsTheBlobAndKeepsIt) {
  auto blob = std::make_shared<MemoryBlob>(Whole());
  const std::weak_ptr<MemoryBlob> watch = blob;
  const auto bytes = blob->bytes();
  auto family = OpenFamily(std::move(blob), "f");
  ASSERT_THAT(family, Succeeds());
  const auto* const vertices = reinterpret_cast<const std::byte*>(family->vertices.data());
  EXPECT_GE(vertices, bytes.data());
  EXPECT_LT(vertices, bytes.data() + bytes.size());
  EXPECT_EQ(reinterpret_cast<uintptr_t>(vertices) % 64, 0);
  EXPECT_FALSE(watch.expired());
  *family = {};
  EXPECT_TRUE(watch.expired());
}

TEST(FamilyFile, IsTheSameWhateverTheVersionAndTheTimeItTook) {
  const Sample sample;
  mesh::RegisteredFamily family = sample.View();
  family.version = 17;
  family.targets[0].report.seconds = 99.0;
  EXPECT_TRUE(Written(family) == Whole());
  EXPECT_EQ(ManifestOf(family).version(), 17);
  EXPECT_EQ(ManifestOf(family).reports(0).seconds(), 99.0);
  EXPECT_EQ(ManifestOf(family).reports(0).target(), "thick");
  EXPECT_EQ(ManifestOf(family).sections_size(), 0);
}

TEST(FamilyFile, NoticesEachByteThatChanges) {
  const std::string whole = Whole();
  for (size_t i = 0; i < whole.size(); ++i) {
    for (const int mask : {0x01, 0x80, 0xff}) {
      std::string changed = whole;
      changed[i] = static_cast<char>(changed[i] ^ mask);
      const absl::Status status = Open(changed).status();
      EXPECT_TRUE(absl::IsDataLoss(status) || absl::IsInvalidArgument(status)) << i << " " << mask;
      EXPECT_TRUE(absl::StrContains(status.message(), "family file f.lbfam: ")) << status;
    }
  }
}

TEST(FamilyFile, NoticesEachLengthThatIsNotItsOwn) {
  const std::string whole = Whole();
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THAT(Open(whole.substr(0, size)), Fails(Code::kDataLoss, "family file f.lbfam: "))
        << size;
  }
  EXPECT_THAT(Open(whole + '\0'), Fails(Code::kDataLoss, "goes on after the last section"));
}

TEST(FamilyFile, NamesTheDamagedSection) {
  const std::string whole = Whole();
  Manifest manifest;
  EXPECT_THAT(Open(WithManifest<Manifest>(whole, [&](Manifest& m) { manifest = m; })), Succeeds());
  int num_damaged = 0;
  for (const v1::Section& section : manifest.sections()) {
    if (section.count() == 0) continue;
    ++num_damaged;
    std::string changed = whole;
    changed[section.offset()] ^= 1;
    EXPECT_THAT(Open(changed),
                Fails(Code::kDataLoss, absl::StrCat("section ", section.name(), ": its checksum")));
  }
  EXPECT_GE(num_damaged, 8);
}

TEST(FamilyFile, RefusesSectionsThatReachBeyondTheFile) {
  for (const uint64_t count : {uint64_t{11}, uint64_t{1000}, uint64_t{1} << 60, uint64_t{1} << 63,
                               std::numeric_limits<uint64_t>::max()}) {
    EXPECT_THAT(
        Open(Changed([&](Manifest& m) { m.mutable_sections(7)->set_count(count); })).status(),
        Fails(Code::kDataLoss, "section displacement.1: "))
        << count;
  }
}

TEST(FamilyFile, RefusesSectionsInOtherPlaces) {
  for (const uint64_t offset :
       {uint64_t{0}, uint64_t{1}, uint64_t{64}, std::numeric_limits<uint64_t>::max()}) {
    EXPECT_THAT(
        Open(Changed([&](Manifest& m) { m.mutable_sections(1)->set_offset(offset); })).status(),
        Fails(Code::kInvalidArgument, "section tetrahedra: offset "))
        << offset;
  }
}

TEST(FamilyFile, RefusesSectionsOfOtherNamesSizesAndNumbers) {
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_sections(2)->set_element_bytes(16); })),
              Fails(Code::kInvalidArgument, "section pyramids: elements of 16 bytes, not 20"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_sections(2)->set_element_bytes(0); })),
              Fails(Code::kInvalidArgument, "section pyramids: elements of 0 bytes"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_sections(3)->set_name("wedgez"); })),
              Fails(Code::kInvalidArgument, "has section wedgez in the place of wedges"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_sections()->RemoveLast(); })),
              Fails(Code::kInvalidArgument, "8 sections for 2 targets and 0 coarser"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.clear_sections(); })),
              Fails(Code::kInvalidArgument, "0 sections for 2 targets and 0 coarser"));
}

TEST(FamilyFile, RefusesAManifestThatContradictsItself) {
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_reports()->RemoveLast(); })),
              Fails(Code::kInvalidArgument, "1 reports for 2 targets"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_domain()->add_min(0.0f); })),
              Fails(Code::kInvalidArgument, "domain"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.clear_domain(); })),
              Fails(Code::kInvalidArgument, "domain"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.set_num_first_vertices(-1); })),
              Fails(Code::kInvalidArgument, ""));
}

TEST(FamilyFile, RefusesArraysThatTheKernelsCannotUse) {
  Sample sample;
  sample.hexahedra[0][3] = 10;
  EXPECT_THAT(Open(Written(sample.View())),
              Fails(Code::kInvalidArgument, "f.lbfam: family walls: hexahedron 0 has vertex 10"));
  sample = Sample();
  sample.displacement.pop_back();
  EXPECT_THAT(Open(Written(sample.View())), Fails(Code::kInvalidArgument, "target thick"));
  sample = Sample();
  sample.vertices[4][1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(Open(Written(sample.View())), Fails(Code::kInvalidArgument, "vertex 4"));
}

TEST(FamilyFile, RefusesMemoryThatIsNotAligned) {
  EXPECT_THAT(OpenFamily(std::make_shared<MemoryBlob>(Whole(), 4), "f"),
              Fails(Code::kInvalidArgument, "unaligned"));
}

TEST(FamilyFile, HoldsAnEmptyFamily) {
  mesh::RegisteredFamily family;
  family.num_frames = 1;
  const auto opened = Open(Written(family));
  ASSERT_THAT(opened, Succeeds());
  EXPECT_EQ(opened->num_cells(), 0);
  EXPECT_TRUE(opened->targets.empty());
}

TEST(FamilyFile, GoesThroughABlobStore) {
  const TemporaryFolder folder;
  const auto blobs = OpenLocalBlobStore(folder.path());
  ASSERT_THAT(blobs, Succeeds());
  auto writer = (*blobs)->Create();
  ASSERT_THAT(writer, Succeeds());
  const Sample sample;
  ASSERT_THAT(WriteFamily(sample.View(), **writer), Succeeds());
  const auto id = (*writer)->Commit();
  ASSERT_THAT(id, Succeeds());
  auto blob = (*blobs)->Open(*id);
  ASSERT_THAT(blob, Succeeds());
  const auto family = OpenFamily(*std::move(blob), *id);
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(Copy(family->vertices), sample.vertices);
}

}  // namespace
}  // namespace liquidblend::store::family_file_test
