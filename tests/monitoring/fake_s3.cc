// The fake S3 of the tests of core/store as a program, for tests in Python: prints its endpoint.
// Each line of its input is the fault of all requests from then on, and is printed once it is set.
#include <iostream>
#include <map>
#include <string>

#include "tests/core/store/blobs/fake_s3.h"

int main() {
  using liquidblend::store::FakeS3;
  const std::map<std::string, FakeS3::Fault> faults = {{"none", FakeS3::Fault::kNone},
                                                       {"unavailable", FakeS3::Fault::kStatus503},
                                                       {"denied", FakeS3::Fault::kStatus403}};
  FakeS3 s3;
  std::cout << s3.endpoint() << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    const auto fault = faults.find(line);
    if (fault == faults.end()) {
      std::cerr << "fake_s3: unknown fault: " << line << std::endl;
      return 2;
    }
    s3.SetFault(fault->second);
    std::cout << line << std::endl;
  }
  return 0;
}
