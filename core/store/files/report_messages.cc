#include "core/store/files/report_messages.h"

#include <algorithm>

#include "core/store/files/correspondence_records.h"
#include "core/store/files/message_fields.h"

namespace liquidblend::store {
namespace {

template <typename Report>
void SetFigures(const Report& report, Message& message) {
  Report::ForEachFigure(
      report, [&](const char* name, const auto& figure) { SetField(name, figure, message); });
}

template <typename Report>
void GetFigures(const Message& message, Report& report) {
  Report::ForEachFigure(report,
                        [&](const char* name, auto& figure) { GetField(name, message, figure); });
}

v1::PartLife ToMessage(const mesh::PartLife& life) {
  v1::PartLife message;
  message.mutable_source_start_m()->Add(life.source_start_m.begin(), life.source_start_m.end());
  message.set_source_end_frames(life.source_end_frames);
  message.set_target_end_frames(life.target_end_frames);
  return message;
}

mesh::PartLife FromMessage(const v1::PartLife& message) {
  mesh::PartLife life = {{}, message.source_end_frames(), message.target_end_frames()};
  std::copy_n(message.source_start_m().begin(), std::min(message.source_start_m_size(), 3),
              life.source_start_m.begin());
  return life;
}

}  // namespace

v1::RegistrationReport ToMessage(const mesh::FamilyTarget& target, double frames_per_second) {
  v1::RegistrationReport message;
  message.set_target(target.name);
  SetFigures(target.report, message);
  for (const mesh::CorrespondenceReport& report : target.report.correspondences) {
    *message.add_correspondences() = ToRecord(report, frames_per_second);
  }
  if (target.report.verdict.grade != mesh::Grade::kUnknown) {
    *message.mutable_verdict() = ToMessage(target.report.verdict);
  }
  const mesh::RestReport& rest = target.report.rest;
  if (!rest.reason.empty()) {
    message.mutable_rest()->set_is_from_rest(rest.is_from_rest);
    message.mutable_rest()->set_time_frames(rest.time_frames);
    message.mutable_rest()->set_reason(rest.reason);
  }
  for (const mesh::Hypothesis& tried : target.report.hypotheses) {
    v1::Hypothesis& added = *message.add_hypotheses();
    added.set_pairing(tried.pairing);
    added.set_cost(tried.cost);
    added.set_is_kept(tried.is_kept);
  }
  for (const mesh::PartLife& life : target.report.part_lives) {
    *message.add_part_lives() = ToMessage(life);
  }
  return message;
}

// Grades have the same numbers in all programs.
v1::Verdict ToMessage(const mesh::Verdict& verdict) {
  v1::Verdict message;
  message.set_grade(static_cast<v1::Grade>(verdict.grade));
  message.set_reason(verdict.reason);
  message.mutable_worst()->Add(verdict.worst.begin(), verdict.worst.end());
  SetFigures(verdict, message);
  return message;
}

v1::SpaceTimeReport ToMessage(const mesh::SpaceTimeReport& report) {
  v1::SpaceTimeReport message;
  message.set_connectivity(report.is_tracked ? v1::TRACKED : v1::REBUILT);
  SetFigures(report, message);
  SetFigures(report.fidelity, *message.mutable_fidelity());
  return message;
}

mesh::RegistrationReport FromMessage(const v1::RegistrationReport& message,
                                     double frames_per_second) {
  mesh::RegistrationReport report;
  GetFigures(message, report);
  for (const v1::CorrespondenceReport& correspondence : message.correspondences()) {
    report.correspondences.push_back(FromRecord(correspondence, frames_per_second));
  }
  report.verdict = FromMessage(message.verdict());
  report.rest = {message.rest().is_from_rest(), message.rest().time_frames(),
                 message.rest().reason()};
  for (const v1::Hypothesis& tried : message.hypotheses()) {
    report.hypotheses.push_back({tried.pairing(), tried.cost(), tried.is_kept()});
  }
  for (const v1::PartLife& life : message.part_lives()) {
    report.part_lives.push_back(FromMessage(life));
  }
  return report;
}

mesh::Verdict FromMessage(const v1::Verdict& message) {
  mesh::Verdict verdict;
  if (v1::Grade_IsValid(message.grade())) verdict.grade = mesh::Grade{message.grade()};
  verdict.reason = message.reason();
  std::copy_n(message.worst().begin(), std::min<size_t>(message.worst_size(), 4),
              verdict.worst.begin());
  GetFigures(message, verdict);
  return verdict;
}

mesh::SpaceTimeReport FromMessage(const v1::SpaceTimeReport& message) {
  mesh::SpaceTimeReport report;
  report.is_tracked = message.connectivity() == v1::TRACKED;
  GetFigures(message, report);
  GetFigures(message.fidelity(), report.fidelity);
  return report;
}

}  // namespace liquidblend::store
