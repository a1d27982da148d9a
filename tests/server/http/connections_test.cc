#include "server/http/connections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace liquidblend::http {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class Recorder : public Connection {
 public:
  void OnPhase(Phase phase) override { phases.push_back(phase); }
  std::vector<Phase> phases;
};

TEST(Connections, ThereAreNoMoreThanAllowed) {
  const auto all = std::make_shared<Connections>();
  std::optional<Connections::Ticket> first = all->Enter(2);
  {
    const std::optional<Connections::Ticket> second = all->Enter(2);
    ASSERT_TRUE(second.has_value());
    EXPECT_FALSE(all->Enter(2).has_value());
  }
  const std::optional<Connections::Ticket> third = all->Enter(2);
  EXPECT_TRUE(third.has_value());
  const Connections::Ticket moved = *std::move(first);  // still one place
  first.reset();
  EXPECT_FALSE(all->Enter(2).has_value());
}

TEST(Connections, EachHearsOfEveryPhaseOnce) {
  const auto all = std::make_shared<Connections>();
  std::optional<Connections::Ticket> ticket = all->Enter(10);
  const auto connection = std::make_shared<Recorder>();
  ticket->Watch(connection);
  EXPECT_THAT(connection->phases, IsEmpty());
  for (const Phase phase :
       {Phase::kDraining, Phase::kStopping, Phase::kDraining, Phase::kStopping, Phase::kAborting}) {
    all->Advance(phase);
  }
  EXPECT_THAT(connection->phases,
              ElementsAre(Phase::kDraining, Phase::kStopping, Phase::kAborting));
  EXPECT_EQ(all->phase(), Phase::kAborting);
}

TEST(Connections, WhoeverTakesOverATicketIsToldInstead) {
  const auto all = std::make_shared<Connections>();
  std::optional<Connections::Ticket> ticket = all->Enter(10);
  const auto before = std::make_shared<Recorder>(), after = std::make_shared<Recorder>();
  ticket->Watch(before);
  all->Advance(Phase::kDraining);
  ticket->Watch(after);  // late: is told at once
  EXPECT_THAT(after->phases, ElementsAre(Phase::kDraining));
  all->Advance(Phase::kStopping);
  EXPECT_THAT(before->phases, ElementsAre(Phase::kDraining));
  EXPECT_THAT(after->phases, ElementsAre(Phase::kDraining, Phase::kStopping));
}

TEST(Connections, NobodyEntersAPortThatStops) {
  const auto all = std::make_shared<Connections>();
  all->Advance(Phase::kDraining);
  EXPECT_TRUE(all->Enter(1).has_value());  // probes
  all->Advance(Phase::kStopping);
  EXPECT_FALSE(all->Enter(1).has_value());
}

TEST(Connections, AwaitNoneWaitsForTheLast) {
  const auto all = std::make_shared<Connections>();
  EXPECT_TRUE(all->AwaitNone(absl::ZeroDuration()));
  std::optional<Connections::Ticket> ticket = all->Enter(1);
  EXPECT_FALSE(all->AwaitNone(absl::Milliseconds(1)));
  const std::jthread leaver([&] { ticket.reset(); });
  EXPECT_TRUE(all->AwaitNone(absl::InfiniteDuration()));
}

}  // namespace
}  // namespace liquidblend::http
