#include "core/store/blobs/aws_signer.h"

#include <gtest/gtest.h>

#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

// The examples of "Signature Calculations for the Authorization Header" in S3's manual.
const AwsCredentials kCredentials = {"AKIAIOSFODNN7EXAMPLE",
                                     "wJalrXUtnFEMI/K7MDENG/bPxRfiCYEXAMPLEKEY", ""};
const absl::Time kTime = absl::FromCivil(absl::CivilSecond(2013, 5, 24), absl::UTCTimeZone());

TEST(AwsSigner, SignsTheManualsListOfABucket) {
  const AwsRequest request = {"GET",
                              "examplebucket.s3.amazonaws.com",
                              "/",
                              {{"prefix", "J"}, {"max-keys", "2"}},
                              Sha256Hex({})};
  const auto headers = SignRequest(request, kCredentials, "us-east-1", kTime);
  EXPECT_EQ(headers.at("x-amz-date"), "20130524T000000Z");
  EXPECT_EQ(headers.at("x-amz-content-sha256"),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(headers.at("Authorization"),
            "AWS4-HMAC-SHA256 "
            "Credential=AKIAIOSFODNN7EXAMPLE/20130524/us-east-1/s3/aws4_request, "
            "SignedHeaders=host;x-amz-content-sha256;x-amz-date, "
            "Signature=34b48302e7b5fa45bde8084f4b7868a86f0a534bc59db6670ed5711ef69dc6f7");
}

TEST(AwsSigner, SignsTheManualsQueryWithoutAValue) {
  const AwsRequest request = {
      "GET", "examplebucket.s3.amazonaws.com", "/", {{"lifecycle", ""}}, Sha256Hex({})};
  const auto headers = SignRequest(request, kCredentials, "us-east-1", kTime);
  EXPECT_NE(headers.at("Authorization")
                .find("fea454ca298b7da1c68078a5d1bdbfbbe0d65c699e0f91ac7a200a0136783543"),
            std::string::npos);
}

TEST(AwsSigner, SignsTheTokenOfTemporaryCredentials) {
  AwsCredentials credentials = kCredentials;
  credentials.session_token = "token";
  const AwsRequest request = {"GET", "host", "/", {}, Sha256Hex({})};
  const auto headers = SignRequest(request, credentials, "us-east-1", kTime);
  EXPECT_EQ(headers.at("x-amz-security-token"), "token");
  EXPECT_NE(headers.at("Authorization").find(";x-amz-security-token,"), std::string::npos);
}

// The example of "Authenticating Requests: Using Query Parameters" there.
TEST(AwsSigner, PresignsTheManualsGet) {
  const AwsRequest request = {"GET", "examplebucket.s3.amazonaws.com", "/test.txt", {}, ""};
  EXPECT_EQ(PresignQuery(request, {}, kCredentials, "us-east-1", kTime, absl::Hours(24)),
            "X-Amz-Algorithm=AWS4-HMAC-SHA256&X-Amz-Credential=AKIAIOSFODNN7EXAMPLE%2F20130524%2F"
            "us-east-1%2Fs3%2Faws4_request&X-Amz-Date=20130524T000000Z&X-Amz-Expires=86400&"
            "X-Amz-SignedHeaders=host&X-Amz-Signature="
            "aeeed9bbccd4d02ee5c0109b86d86835f995330da4c265957d157751f604d404");
}

TEST(AwsSigner, PresignsHeadersAndTheTokenOfTemporaryCredentials) {
  AwsCredentials credentials = kCredentials;
  credentials.session_token = "to/ken";
  const AwsRequest request = {"PUT", "host", "/key", {{"partNumber", "2"}}, ""};
  const auto query = [&](const std::string& length) {
    return PresignQuery(request, {{"content-length", length}}, credentials, "us-east-1", kTime,
                        absl::Minutes(15));
  };
  EXPECT_NE(query("7").find("X-Amz-SignedHeaders=content-length%3Bhost"), std::string::npos);
  EXPECT_NE(query("7").find("X-Amz-Security-Token=to%2Fken"), std::string::npos);
  EXPECT_NE(query("7").find("&partNumber=2&X-Amz-Signature="), std::string::npos);
  EXPECT_NE(query("7"), query("8"));
}

TEST(AwsSigner, MakesEtagsOfPartsAsS3Does) {
  const std::string a = "0cc175b9c0f1b6a831c399e269772661", b = "92eb5ffee6ae2fec3ad71c777531578f";
  EXPECT_EQ(Md5Hex(AsBytes(std::string("a"))), a);
  const std::vector<std::string> parts = {a, b};
  EXPECT_EQ(EtagOfParts(parts), "96e024ba2074fe77e8e965ba43a704be-2");
  const std::vector<std::string> encrypted = {a, "92eb5ffee6ae2fec3ad71c777531578f-x"};
  EXPECT_EQ(EtagOfParts(encrypted), "");
}

TEST(AwsSigner, EncodesAllButPlainCharacters) {
  EXPECT_EQ(UriEncode("aZ09-._~/ +\xc3\xa4", EncodeSlashes::kNo), "aZ09-._~/%20%2B%C3%A4");
  EXPECT_EQ(UriEncode("a/b", EncodeSlashes::kYes), "a%2Fb");
  EXPECT_EQ(EncodeQuery({{"b", "1 2"}, {"a", ""}}), "a=&b=1%202");
}

}  // namespace
}  // namespace liquidblend::store
