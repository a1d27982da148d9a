#include "server/frames/frame_queue.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "absl/strings/str_cat.h"

namespace liquidblend::server {

absl::Status FrameQueueOptions::Validate() const {
  if (max_waiting_cost < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_waiting_cost is ", max_waiting_cost, ", not at least 1"));
  }
  if (quantum < 1) {
    return absl::InvalidArgumentError(absl::StrCat("quantum is ", quantum, ", not at least 1"));
  }
  return absl::OkStatus();
}

bool FrameQueue::HasRoomFor(const FrameWork& work) const {
  if (waiting_cost_ == 0 || waiting_cost_ + work.cost <= options_.max_waiting_cost) return true;
  const auto found = accounts_.find({work.client, work.is_paced});
  const bool is_new = found == accounts_.end() || found->second.waiting.empty();
  const int64_t part =
      options_.max_waiting_cost / (std::ssize(waiting_accounts_) + (is_new ? 1 : 0));
  return (is_new ? 0 : found->second.waiting_cost) + work.cost <= part;
}

FrameQueue::Place FrameQueue::Push(FrameWork work) {
  const Place place = {{work.client, work.is_paced}, {work.deadline, num_pushed_++}};
  Balance& balance = BalanceOf(place.account, work.host);
  if (balance.waiting.empty()) {
    waiting_accounts_.push_back(&balance);
    balance.tag = std::max(balance.tag, EarliestTag());
  }
  balance.waiting_cost += work.cost;
  waiting_cost_ += work.cost;
  balance.waiting.emplace(place.order, std::move(work));
  return place;
}

FrameQueue::Balance& FrameQueue::BalanceOf(const Account& account, const std::string& host) {
  if (accounts_.size() >= kManyAccounts) ForgetIdle();
  const auto [found, is_new] = accounts_.try_emplace(account);
  Balance& balance = found->second;
  if (!is_new) return balance;
  balance.account = account;
  balance.host = host;
  balance.tag = round_;
  if (host.empty()) return balance;
  for (const auto& [other, before] : accounts_) {
    const bool is_idle_kin =
        other.second == account.second && before.host == host && before.waiting.empty();
    if (is_idle_kin) balance.tag = std::max(balance.tag, before.tag);
  }
  return balance;
}

FrameWork FrameQueue::Pop() {
  assert(!empty());
  Balance& balance = NextAccount();
  FrameWork work = Take(balance, balance.waiting.begin()->first);
  round_ = std::max(round_, balance.tag);
  balance.tag += work.cost;
  largest_tag_ = std::max(largest_tag_, balance.tag);
  if (empty()) round_ = largest_tag_;
  return work;
}

std::optional<FrameWork> FrameQueue::Remove(const Place& place) {
  const auto account = accounts_.find(place.account);
  if (account == accounts_.end() || !account->second.waiting.contains(place.order)) {
    return std::nullopt;
  }
  return Take(account->second, place.order);
}

FrameQueue::Balance& FrameQueue::NextAccount() const {
  int64_t lowest = std::numeric_limits<int64_t>::max();
  for (const Balance* balance : waiting_accounts_) lowest = std::min(lowest, balance->tag);
  // Paced work before other work, then by deadline.
  const auto urgency = [](const Balance& balance) {
    return std::pair(!balance.account.second, balance.waiting.begin()->first);
  };
  Balance* best = nullptr;
  for (Balance* balance : waiting_accounts_) {
    if (balance->tag - lowest > options_.quantum) continue;
    if (best == nullptr || urgency(*balance) < urgency(*best)) best = balance;
  }
  return *best;
}

FrameWork FrameQueue::Take(Balance& balance, const Order& order) {
  const auto found = balance.waiting.find(order);
  FrameWork taken = std::move(found->second);
  balance.waiting.erase(found);
  balance.waiting_cost -= taken.cost;
  waiting_cost_ -= taken.cost;
  if (balance.waiting.empty()) std::erase(waiting_accounts_, &balance);
  return taken;
}

// Forgets idle accounts that would start no later as new ones.
void FrameQueue::ForgetIdle() {
  std::erase_if(accounts_, [&](const auto& account) {
    return account.second.waiting.empty() && account.second.tag <= round_;
  });
}

}  // namespace liquidblend::server
