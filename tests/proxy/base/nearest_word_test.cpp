// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/nearest_word.h"

#include <gtest/gtest.h>

#include <array>

namespace vestige {
namespace {

TEST(DidYouMean, NamesTheNearestWordOrNothing) {
  EXPECT_EQ(didYouMean("fornt", {"back", "front", "top"}), " (did you mean 'front'?)");
  EXPECT_EQ(didYouMean("zzzzzz", {"back", "front", "top"}), "");
  EXPECT_EQ(didYouMean("front", {"front"}), "");
  EXPECT_EQ(didYouMean("T", {"p", "t"}), " (did you mean 't'?)");
  EXPECT_EQ(didYouMean("xy", {"gl", "ao"}), "") << "no letter of it is right";
}

TEST(OptionHints, NameTheOptionsThatWereMeant) {
  const std::vector<std::string> options{"--colormap", "--color-range", "--size"};
  const std::array<const char*, 5> arguments{"render", "--colrmap=hot", "--size", "-x", "--qqqqqq"};
  EXPECT_EQ(optionHints(options, arguments),
            "No option is called --colrmap: did you mean --colormap?\n");
}

}  // namespace
}  // namespace vestige
