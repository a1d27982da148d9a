// Frames of a family on a server.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/player/frame_fetcher.h"
#include "client/player/frame_source.h"
#include "liquidblend/client.h"

namespace liquidblend::player {

// What the server says of a family.
FamilyFacts FactsOf(const Family& family);

// Frames of one version of the family, whatever is published meanwhile.
class ServerSource final : public FrameSource {
 public:
  // Connects, and asks for the family.
  //   options  retries are the player's: theirs are not used
  //   version  0: the published one
  // Errors: those of Client::Connect() and GetFamily(); kFailedPrecondition if no version of the
  // family is registered yet.
  static absl::StatusOr<std::unique_ptr<ServerSource>> Open(ConnectOptions options,
                                                            const std::string& family,
                                                            int64_t version);

  const FamilyFacts& facts() const override { return facts_; }
  absl::Status Get(const FrameSpec& spec, FramePool& pool, FrameMesh& out,
                   FrameCost& cost) override;

 private:
  ServerSource(std::unique_ptr<Client> client, std::unique_ptr<Client> patient,
               const Family& family);

  const std::unique_ptr<Client> client_;          // whose calls are short
  const std::unique_ptr<Client> patient_client_;  // for exact frames
  FrameFetcher fetcher_, patient_fetcher_;
  const FamilyFacts facts_;
};

}  // namespace liquidblend::player
