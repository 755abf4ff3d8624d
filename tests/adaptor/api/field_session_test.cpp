// SPDX-License-Identifier: BSD-3-Clause
//
// Reduced fields through a session.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "proxy/archive/archive.h"
#include "proxy/format/layout/field_layout.h"
#include "simulation.h"

namespace vestige::test {
namespace {

FieldSamples storedField(const std::string& path, double* error = nullptr) {
  const Archive archive(path);
  EXPECT_EQ(damageOf(path), "");
  const ArchiveRow* row = archive.find(1, kFieldView, "f", kind::kField);
  if (!row) throw std::runtime_error("no field is stored");
  const ProxyImage image = archive.open(*row).image();
  if (error) *error = image.part("zfp").error;
  return fieldSamples(image);
}

/// Samples [from, to) along x of a sample, of which `below` and `above` are ghosts.
struct Part {
  Sample sample;

  Part(const Sample& whole, int from, int to, int below, int above) {
    sample.size = {to - from, whole.size[1], whole.size[2]};
    sample.values.clear();
    for (int z = 0; z < whole.size[2]; ++z) {
      for (int y = 0; y < whole.size[1]; ++y) {
        for (int x = from; x < to; ++x) {
          // Ghosts hold what must not be stored.
          const bool ghost = x < from + below || x >= to - above;
          sample.values.push_back(
              ghost ? 1e3f
                    : whole.values[std::size_t((z * whole.size[1] + y) * whole.size[0] + x)]);
        }
      }
    }
    sample.grid = whole.grid;
    sample.grid.points[0] = to - from;
    sample.grid.first[0] = from;
    sample.grid.ghosts[0] = below;
    sample.grid.ghosts[1] = above;
  }
};

TEST(FieldSession, IsStoredOnceWithinTheToleranceThatItStates) {
  const Folder folder;
  const Sample sample({21, 14, 11});
  const auto run = [&](const std::string& path, const std::string& more) {
    Simulation simulation(path, std::string(kSmallImage) + "proxies = ['field']\n" + more);
    ASSERT_EQ(simulation.step(sample, 1), VESTIGE_OK) << simulation.error();
  };
  run(folder / "a.cdb", "[reduced_field]\ntolerance = 1e-3\n");
  double error = 0.0;
  const FieldSamples field = storedField(folder / "a.cdb", &error);
  EXPECT_NEAR(error, 1e-3 * (field.high - field.low), 1e-12);
  ASSERT_EQ(field.values.size(), sample.values.size());
  for (std::size_t i = 0; i < field.values.size(); ++i) {
    const double value = field.low + double(field.values[i]) * (field.high - field.low);
    ASSERT_NEAR(value, sample.values[i], error * 1.001) << i;
  }
  EXPECT_EQ(Archive(folder / "a.cdb").rows().size(), 1u);  // one row, whatever the views

  run(folder / "b.cdb", "[reduced_field]\nabsolute_tolerance = 0.01\nreduction = 2\n");
  const FieldSamples half = storedField(folder / "b.cdb", &error);
  EXPECT_EQ(error, 0.01);
  EXPECT_EQ(half.axes[0].count, 11);
  EXPECT_EQ(half.axes[2].count, 6);
  EXPECT_NEAR(half.axes[0].spacing, 0.1, 1e-12);
}

TEST(FieldSession, BlocksMakeOneFieldAndGhostsAreLeftOut) {
  const Folder folder;
  const Sample whole({21, 14, 11});
  const std::string config = std::string(kSmallImage) +
                             "proxies = ['field', 'mip']\n[reduced_field]\ntolerance = 1e-6\n" +
                             "[[field]]\nsource = 'f'\nrange = [-1, 2]\n";
  {
    Simulation run(folder / "whole.cdb", config);
    ASSERT_EQ(run.step(whole, 1), VESTIGE_OK) << run.error();
  }
  {
    const Part left(whole, 0, 12, 0, 2), right(whole, 8, 21, 1, 0);  // both own the points at 9
    Simulation run(folder / "parts.cdb", config);
    int index = 0;
    for (const Part* part : {&left, &right}) {
      vestige_block(run.session, index, &part->sample.grid);
      vestige_share_field(run.session, index, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1,
                          part->sample.values.data(), nullptr);
      ++index;
    }
    ASSERT_EQ(vestige_execute(run.session, 1, 0.1), VESTIGE_OK) << run.error();
  }
  const FieldSamples a = storedField(folder / "whole.cdb"), b = storedField(folder / "parts.cdb");
  EXPECT_EQ(a.axes, b.axes);
  EXPECT_EQ(a.values, b.values);
  EXPECT_EQ(Archive(folder / "parts.cdb").views().front(), "front");  // fields come last
}

TEST(FieldSession, SaysWhatIsWrongInTheConfiguration) {
  const Folder folder;
  const auto sentence = [&](const std::string& text) {
    Simulation run(folder / "x.cdb", text);
    EXPECT_NE(run.opened, VESTIGE_OK) << text;
    return run.error();
  };
  const std::string on = "[image]\nproxies = ['field']\n";
  EXPECT_NE(sentence("[reduced_field]\ntolerance = 1e-3\n").find("does not name \"field\""),
            std::string::npos);
  EXPECT_NE(sentence(on + "[reduced_field]\ntolerance = 1.5\n").find("1.5"), std::string::npos);
  EXPECT_NE(sentence(on + "[reduced_field]\nreduction = 0\n").find("reduction"), std::string::npos);
  EXPECT_NE(sentence(on + "[reduced_field]\ntolerance = 0.1\nabsolute_tolerance = 1\n")
                .find("absolute_tolerance"),
            std::string::npos);
  EXPECT_NE(sentence(on + "[[view]]\nname = 'volume'\ndirection = [1, 0, 0]\n").find("volume"),
            std::string::npos);
}

}  // namespace
}  // namespace vestige::test
