// Queue of frames to be made: fair to clients by cost; among clients whose turn it is, paced
// streams first, then the most urgent. Knows no clock and no threads.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::server {

// Work that waits for its turn.
struct FrameWork {
  std::string client;       // the account that is charged
  bool is_paced = false;    // a frame that has to be on time
  int64_t cost = 1;         // >= 1; expected cells
  absl::Duration deadline;  // when it becomes late, on a clock that only goes forward
  absl::AnyInvocable<void()> run;
  std::string host = {};  // of a client that may reconnect under another name; or empty
};

// Options of the queue, in cells of expected work.
struct FrameQueueOptions {
  // >= 1; cells. Some 2 s of work for two cores.
  int64_t max_waiting_cost = 200'000'000;
  // >= 1; cells. The lead over other clients that urgent work may give to a client.
  int64_t quantum = 500'000;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Queue of frames to be made, by start-time fair queueing. A client has an account for its paced
// work and one for the rest, whose tag is the cost served to it so far. A new account starts at the
// present round, or at the tags of its host's accounts without work, so that new connections give
// no advantage. An account that returns starts up to two quanta before the round, but not before
// its own tag.
// Of the accounts within a quantum of the lowest tag, paced work goes first, then the earliest
// deadline. So clients that ask for less than their share go before those that ask for more,
// streams go before calls, and no client starves.
// Threads: one at a time.  Cost: O(log work) to push, O(accounts with work) to pop; O(accounts) for
// a new one.
class FrameQueue {
 public:
  using Account = std::pair<std::string, bool>;      // client, is_paced
  using Order = std::pair<absl::Duration, int64_t>;  // deadline, then first come
  // Place of waiting work in the queue.
  struct Place {
    Account account;
    Order order;
  };

  explicit FrameQueue(const FrameQueueOptions& options) : options_(options) {}

  // Whether the work may wait: all waiting work costs at most the limit, or the account's waiting
  // work at most the account's part of it, or the queue is empty.
  bool HasRoomFor(const FrameWork& work) const;

  // Adds work; returns its place.
  Place Push(FrameWork work);
  FrameWork Pop();  // Requires: !empty()
  // Removes waiting work; nothing if it has been popped.
  std::optional<FrameWork> Remove(const Place& place);

  bool empty() const { return waiting_accounts_.empty(); }
  // The cost of all waiting work.
  int64_t waiting_cost() const { return waiting_cost_; }
  size_t num_accounts() const { return accounts_.size(); }  // remembered ones

 private:
  struct Balance {
    Account account;
    std::string host;
    std::map<Order, FrameWork> waiting;
    int64_t waiting_cost = 0;
    int64_t tag = 0;
  };
  // Number of accounts below which no account is forgotten.
  static constexpr size_t kManyAccounts = 4096;

  Balance& BalanceOf(const Account& account, const std::string& host);
  Balance& NextAccount() const;
  FrameWork Take(Balance& balance, const Order& order);
  void ForgetIdle();
  // Start of an account that returns after a long time.
  int64_t EarliestTag() const { return round_ - 2 * options_.quantum; }

  const FrameQueueOptions options_;
  std::map<Account, Balance> accounts_;
  std::vector<Balance*> waiting_accounts_;  // those with work
  int64_t waiting_cost_ = 0;
  int64_t largest_tag_ = 0;
  // The largest tag of served work; the largest of all tags while the queue is empty.
  int64_t round_ = 0;
  int64_t num_pushed_ = 0;
};

}  // namespace liquidblend::server
