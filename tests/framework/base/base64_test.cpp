// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/base/base64.hpp>

namespace base64_test {

TEST(Base64, IsThatOfRfc4648) {
  for (const auto& [bytes, text] : {std::pair("", ""),
                                    {"f", "Zg=="},
                                    {"fo", "Zm8="},
                                    {"foo", "Zm9v"},
                                    {"foob", "Zm9vYg=="},
                                    {"fooba", "Zm9vYmE="},
                                    {"foobar", "Zm9vYmFy"}})
    EXPECT_EQ(marrow::base64(bytes), text);
  EXPECT_EQ(marrow::base64(std::string("\xff\xfe\xfb\x00\x80\x3e", 6)), "//77AIA+") << "bytes are unsigned";
}

}  // namespace base64_test
