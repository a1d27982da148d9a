// Parsers of the XML documents that S3 answers with, by pugixml.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// An object in a list, or found by its key.
struct S3Object {
  std::string key;
  int64_t size_bytes = 0;
  absl::Time modified;
  std::string etag;  // without quotes; lists leave it empty
};

// Page of a list of objects.
struct S3Page {
  std::vector<S3Object> objects;  // in the order of their keys
  std::string next_token;         // empty: no more
};

// Reads a document of ListObjectsV2; keys come back without the prefix.
// Errors: kInternal if it is another document, or an object has no key below the prefix, size or
// time.
absl::StatusOr<S3Page> ParseS3Page(const std::string& document, const std::string& prefix);

// A multipart upload that was begun, and neither completed nor aborted.
struct S3OpenUpload {
  std::string key;
  std::string id;
  absl::Time begun;
};

// Page of a list of multipart uploads.
struct S3UploadPage {
  std::vector<S3OpenUpload> uploads;
  std::string next_key, next_id;  // where the next page begins; empty: no more
};

// Reads a document of ListMultipartUploads, as ParseS3Page() reads its own.
absl::StatusOr<S3UploadPage> ParseS3UploadPage(const std::string& document,
                                               const std::string& prefix);

// The text of the first element of that name. Empty if there is none before the document ends or is
// malformed.
std::string XmlElement(const std::string& document, const char* name);

}  // namespace liquidblend::store
