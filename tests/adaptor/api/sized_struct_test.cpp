// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/api/sized_struct.h"

#include <gtest/gtest.h>

// A struct that has grown by two members since its first version.
namespace vestige {
namespace {

struct Grown {
  std::size_t size;
  int first;
  int second;
  double third;
};
constexpr Grown kDefaults{sizeof(Grown), 1, 2, 3.0};
constexpr std::size_t kFirstSize = offsetof(Grown, second);

Grown read(const Grown& given) { return ofAnyVersion(given, kDefaults, kFirstSize, "grown"); }

TEST(SizedStruct, AnOlderCallerLeavesTheDefaultsOfWhatItDoesNotKnow) {
  const Grown first = read({kFirstSize, 10, -1, -1.0});
  EXPECT_EQ(first.first, 10);
  EXPECT_EQ(first.second, 2);
  EXPECT_EQ(first.third, 3.0);
  const Grown between = read({offsetof(Grown, third), 10, 20, -1.0});
  EXPECT_EQ(between.second, 20);
  EXPECT_EQ(between.third, 3.0);
}

TEST(SizedStruct, ACallerOfTheSameVersionGivesAll) {
  const Grown all = read({sizeof(Grown), 10, 20, 30.0});
  EXPECT_EQ(all.first, 10);
  EXPECT_EQ(all.third, 30.0);
}

TEST(SizedStruct, ANewerCallerIsUnderstoodWhileWhatItAppendedIsUnset) {
  struct {
    Grown known;
    long appended;
  } newer{{sizeof newer, 10, 20, 30.0}, 0};
  EXPECT_EQ(read(newer.known).second, 20);
  newer.appended = 1;
  EXPECT_THROW(read(newer.known), AdaptorError);
}

TEST(SizedStruct, SizesThatNoVersionHasAreRefused) {
  EXPECT_THROW(read({0, 1, 1, 1.0}), AdaptorError);
  EXPECT_THROW(read({kFirstSize - 1, 1, 1, 1.0}), AdaptorError);
  EXPECT_THROW(read({std::size_t(-1), 1, 1, 1.0}), AdaptorError);
}

}  // namespace
}  // namespace vestige
