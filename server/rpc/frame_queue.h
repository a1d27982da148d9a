// Whose frame is made next: fair to clients by cost, and among those whose turn it is streams that
// keep a pace first, then the most urgent. Knows no clock and no threads.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::rpc {

struct FrameWork {
  std::string client;       // who is charged for it
  bool is_paced = false;    // a frame that has to be on time
  int64_t cost = 1;         // >= 1; expected cells
  absl::Duration deadline;  // when it becomes late, on a clock that only goes forward
  absl::AnyInvocable<void()> run;
  std::string host = {};  // of a client that may come back as another one; or empty
};

struct FrameQueueOptions {
  // >= 1; cells. Some 2 s of work for two cores.
  int64_t max_waiting_cost = 200'000'000;
  // >= 1; cells. How far ahead of the others a client may get because its work is more urgent.
  int64_t quantum = 1'000'000;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Start-time fair queueing. A client has an account for its paced work and one for the rest. Each
// account with work owns a tag, the cost served to it so far; one that comes back starts at the
// present round and is owed nothing for its absence; a new one starts where those of its host that
// have no work stand, so that nobody gets ahead by new connections. Of the accounts within a
// quantum of the lowest tag, paced work goes first, then the earliest deadline. So a stream that
// asks for less than its share is served at once, whatever others ask for, and nobody starves.
// Threads: one at a time.  Cost: O(log work) to push, O(accounts) to pop and for a new one.
class FrameQueue {
 public:
  using Account = std::pair<std::string, bool>;      // client, is_paced
  using Order = std::pair<absl::Duration, int64_t>;  // deadline, then first come
  // Where work waits.
  struct Place {
    Account account;
    Order order;
  };

  explicit FrameQueue(const FrameQueueOptions& options) : options_(options) {}

  // Whether this may wait here: all that waits costs no more than the limit, or what its account
  // has waiting no more than its part of it, or nothing waits at all.
  bool HasRoomFor(const FrameWork& work) const;

  Place Push(FrameWork work);
  FrameWork Pop();  // Requires: !empty()
  // What waits there, or nothing if that has been popped.
  std::optional<FrameWork> Remove(const Place& place);

  bool empty() const { return num_waiting_accounts_ == 0; }
  int64_t waiting_cost() const { return waiting_cost_; }

 private:
  struct Balance {
    std::string host;
    std::map<Order, FrameWork> waiting;
    int64_t waiting_cost = 0;
    int64_t tag = 0;
  };
  using Accounts = std::map<Account, Balance>;

  Balance& BalanceOf(const Account& account, const std::string& host);
  Accounts::iterator NextAccount();
  FrameWork Take(Balance& balance, const Order& order);
  void ForgetIdle();

  const FrameQueueOptions options_;
  Accounts accounts_;  // those with work, and those ahead of the present round
  int64_t num_waiting_accounts_ = 0;
  int64_t waiting_cost_ = 0;
  int64_t round_ = 0;  // the largest tag that was served
  int64_t num_pushed_ = 0;
};

}  // namespace liquidblend::rpc
