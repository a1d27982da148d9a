#include "server/frames/unread_answers.h"

#include <iterator>
#include <optional>
#include <utility>

#include "server/base/errors.h"

namespace liquidblend::server {

bool UnreadAnswers::State::HasRoomFor(const Held& wanted) const {
  const auto size = static_cast<int64_t>(wanted.answer->size());
  if (num_bytes == 0 || num_readers.contains(wanted.answer.get())) return true;
  if (num_bytes + size <= options.max_bytes) return true;
  if (num_bytes + size > 2 * options.max_bytes) return false;
  const auto found = bytes_of_account.find(wanted.account);
  const bool is_new = found == bytes_of_account.end();
  const int64_t num_accounts = std::ssize(bytes_of_account) + (is_new ? 1 : 0);
  return (is_new ? 0 : found->second) + size <= options.max_bytes / num_accounts;
}

UnreadAnswers::HeldList::iterator UnreadAnswers::State::Add(Held added) {
  const auto size = static_cast<int64_t>(added.answer->size());
  HeldList entry;
  entry.push_back(std::move(added));
  int64_t& account_bytes = bytes_of_account[entry.back().account];
  int& readers = num_readers[entry.back().answer.get()];  // the last thing that needs memory
  account_bytes += size;
  if (++readers == 1) num_bytes += size;
  held.splice(held.end(), entry);
  return std::prev(held.end());
}

void UnreadAnswers::State::LetGo(HeldList::iterator entry) {
  HeldList gone;  // destroyed without the lock
  absl::MutexLock lock(&mutex);
  const auto size = static_cast<int64_t>(entry->answer->size());
  const auto account = bytes_of_account.find(entry->account);
  account->second -= size;
  if (account->second == 0) bytes_of_account.erase(account);
  const auto readers = num_readers.find(entry->answer.get());
  if (--readers->second == 0) {
    num_readers.erase(readers);
    num_bytes -= size;
  }
  gone.splice(gone.end(), held, entry);
}

std::vector<std::weak_ptr<UnreadAnswers::Reader>> UnreadAnswers::State::FindStalled(
    absl::Duration now) const {
  std::vector<std::weak_ptr<Reader>> stalled;
  if (num_bytes <= options.max_bytes / 2) return stalled;
  for (const Held& entry : held) {
    if (now - entry.since < options.patience) break;
    stalled.push_back(entry.reader);
  }
  return stalled;
}

absl::StatusOr<AnswerPtr> UnreadAnswers::Hold(AnswerPtr answer,
                                              const std::shared_ptr<Reader>& reader,
                                              absl::Duration now) {
  Held wanted = {reader->account(), std::move(answer), reader, now};
  const std::string* const bytes = wanted.answer.get();
  std::vector<std::weak_ptr<Reader>> stalled;
  std::optional<HeldList::iterator> entry;
  {
    absl::MutexLock lock(&state_->mutex);
    stalled = state_->FindStalled(now);
    if (state_->HasRoomFor(wanted)) entry = state_->Add(std::move(wanted));
  }
  AnswerPtr result;  // first, as GiveUp() may throw; without memory for it the deleter is called
  if (entry.has_value()) {
    result =
        AnswerPtr(bytes, [state = state_, entry](const std::string*) { state->LetGo(*entry); });
  }
  for (const std::weak_ptr<Reader>& of : stalled) {
    if (const std::shared_ptr<Reader> given_up = of.lock()) given_up->GiveUp();
  }
  if (result == nullptr) return TooManyAnswers();
  return result;
}

int64_t UnreadAnswers::num_bytes() const {
  absl::MutexLock lock(&state_->mutex);
  return state_->num_bytes;
}

}  // namespace liquidblend::server
