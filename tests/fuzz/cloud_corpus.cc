#include <string>

#include "tests/fuzz/corpus.h"

namespace liquidblend::fuzz {
namespace {

enum Method : char { kGet, kHead, kPut, kPost, kDelete };
enum ClosingTag : char { kNone, kList, kComplete, kCreate, kUploads };

std::string Answer(Method method, ClosingTag tag, int status, const std::string& body) {
  return std::string{static_cast<char>(method), static_cast<char>(tag),
                     static_cast<char>(status >> 8), static_cast<char>(status & 0xff)} +
         body;
}

std::string ErrorDocument(const std::string& code) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Error><Code>" + code +
         "</Code><Message>It&apos;s &lt;refused&gt;</Message><Resource>/bucket/key</Resource>"
         "<RequestId>4442587FB7D0A2F9</RequestId></Error>";
}

constexpr char kPage[] =
    "<ListBucketResult xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\"><Name>bucket</Name>"
    "<Prefix>prefix/</Prefix><KeyCount>2</KeyCount><IsTruncated>true</IsTruncated>"
    "<Contents><Key>prefix/blobs/00/a&amp;b</Key><LastModified>2023-01-02T03:04:05.000Z"
    "</LastModified><ETag>&quot;70ee1738b6b21e2c8a43f3a5ab0eee71&quot;</ETag><Size>11</Size>"
    "<StorageClass>STANDARD</StorageClass></Contents><Contents><Key>prefix/uploads/01/c</Key>"
    "<LastModified>2023-01-02T03:04:05.678Z</LastModified><Size>9223372036854775807</Size>"
    "</Contents><NextContinuationToken>1ueGcxLPRx1Tr/XYExHnhbYLgveDs2J/"
    "</NextContinuationToken></ListBucketResult>";

void AddAnswers(const Corpus& corpus) {
  const auto add = [&](const std::string& name, const std::string& answer) {
    corpus.Add("s3_answer", name, std::as_bytes(std::span(answer)));
  };
  add("page", Answer(kGet, kList, 200, kPage));
  add("page_cut_short", Answer(kGet, kList, 200, std::string(kPage).substr(0, 400)));
  add("uploads",
      Answer(kGet, kUploads, 200,
             "<ListMultipartUploadsResult><KeyMarker/><NextKeyMarker>prefix/uploads/00/a"
             "</NextKeyMarker><NextUploadIdMarker>VXBs</NextUploadIdMarker>"
             "<IsTruncated>true</IsTruncated><Upload><Key>prefix/uploads/00/a</Key>"
             "<UploadId>VXBs</UploadId><Initiated>2023-01-02T03:04:05.000Z</Initiated></Upload>"
             "</ListMultipartUploadsResult>"));
  add("created", Answer(kPost, kCreate, 200,
                        "<InitiateMultipartUploadResult><Bucket>bucket</Bucket><Key>key</Key>"
                        "<UploadId>VXBsb2FkIElE</UploadId></InitiateMultipartUploadResult>"));
  add("completed", Answer(kPost, kComplete, 200,
                          "   \n<?xml version=\"1.0\"?>\n<CompleteMultipartUploadResult>"
                          "<ETag>&#34;3858f62230ac3c915f300c664312c11f-9&#34;</ETag>"
                          "</CompleteMultipartUploadResult>"));
  add("error_in_success", Answer(kPost, kComplete, 200, "  " + ErrorDocument("InternalError")));
  add("slow_down", Answer(kPut, kNone, 503, ErrorDocument("SlowDown")));
  add("no_such_key", Answer(kGet, kNone, 404, ErrorDocument("NoSuchKey")));
  add("no_such_upload", Answer(kPut, kNone, 404, ErrorDocument("NoSuchUpload")));
  add("no_such_bucket", Answer(kGet, kList, 404, ErrorDocument("NoSuchBucket")));
  add("expired", Answer(kGet, kNone, 400, ErrorDocument("ExpiredToken")));
  add("denied", Answer(kDelete, kNone, 403, ErrorDocument("AccessDenied")));
  add("quota", Answer(kPut, kNone, 403, ErrorDocument("QuotaExceeded")));
  add("redirect", Answer(kGet, kNone, 301, ErrorDocument("PermanentRedirect")));
  add("proxy", Answer(kGet, kNone, 404, "<html>default backend - 404</html>"));
  add("head", Answer(kHead, kNone, 404, ""));
}

constexpr char kDocument[] =
    "{\"Code\": \"Success\", \"AccessKeyId\": \"ASIAEXAMPLE\", \"SecretAccessKey\": \"secret\", "
    "\"Token\": \"token\\u002f=\", \"Expiration\": \"2030-01-02T03:04:05Z\", \"LastUpdated\": 7}";
constexpr char kFile[] =
    "# keys\n[default]\naws_access_key_id = AKIAEXAMPLE\nAWS_SECRET_ACCESS_KEY=a=b\r\n\n"
    "[ other ]\n; temporary\naws_access_key_id=ASIAEXAMPLE\naws_secret_access_key = secret\n"
    "aws_session_token = token\nregion\n";

void AddCredentials(const Corpus& corpus) {
  const auto add = [&](const std::string& name, char kind, const std::string& text) {
    const std::string bytes = kind + text;
    corpus.Add("credentials", name, std::as_bytes(std::span(bytes)));
  };
  add("document", 0, kDocument);
  add("document_without_time", 0, "{\"AccessKeyId\": \"id\", \"SecretAccessKey\": \"secret\"}");
  add("document_of_lines", 0,
      "{\"AccessKeyId\": \"id\\r\\nX: y\", \"SecretAccessKey\": \"secret\"}");
  add("no_document", 0, "[[[[{\"AccessKeyId\": null}]]]]");
  add("default_section", 1, kFile);
  add("other_section", 3, kFile);
}

}  // namespace

void AddCloudSeeds(const Corpus& corpus) {
  AddAnswers(corpus);
  AddCredentials(corpus);
}

}  // namespace liquidblend::fuzz
