// SPDX-License-Identifier: BSD-3-Clause
//
// Budgets through a session.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "adaptor/run/session.h"
#include "proxy/archive/archive.h"
#include "simulation.h"

namespace vestige::test {
namespace {

std::string budgeted(const std::string& bytes, const std::string& image) {
  return "[budget]\nbytes_per_step = " + bytes + "\n" + kSmallImage + image;
}

constexpr const char* kStacks = "proxies = ['sliced', 'reference']\n[output]\npreviews = false\n";

std::uintmax_t bytesOfStep(const Archive& archive, long cycle) {
  std::uintmax_t bytes = 0;
  for (const ArchiveRow& row : archive.rows()) {
    if (row.cycle == cycle) bytes += std::filesystem::file_size(archive.directory() / row.exr);
    if (row.cycle == cycle && row.hasPreview())
      bytes += std::filesystem::file_size(archive.directory() / row.png);
  }
  return bytes;
}

std::string provenanceOf(const Archive& archive, long cycle) {
  std::string text;
  for (const ArchiveRow& row : archive.rows()) {
    if (row.cycle != cycle) continue;
    const std::string each = archive.open(row).header().provenance;
    EXPECT_TRUE(text.empty() || text == each) << "one level a step";
    text = each;
  }
  return text;
}

TEST(BudgetSession, StepsGoDownUntilTheyFitAndSayWhere) {
  const Folder folder;
  std::uintmax_t whole = 0;
  {
    Simulation run(folder / "whole.cdb", std::string(kSmallImage) + kStacks);
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
    whole = bytesOfStep(Archive(folder / "whole.cdb"), 1);
  }
  const std::string config = budgeted(std::to_string(whole / 2), kStacks);
  for (const char* name : {"a.cdb", "b.cdb"}) {
    Simulation run(folder / name, config);
    for (int cycle = 1; cycle <= 3; ++cycle) {
      ASSERT_EQ(run.step(Sample(), cycle), VESTIGE_OK) << run.error();
    }
    EXPECT_TRUE(run.logged("more than [budget] bytes_per_step"));
    EXPECT_TRUE(run.logged("it is made again at quality level"));
    EXPECT_EQ(std::count_if(run.log.begin(), run.log.end(),
                            [](const std::string& line) {
                              return line.find("made again") != std::string::npos;
                            }),
              1)
        << "equal steps go down once";
  }
  EXPECT_EQ(damageOf(folder / "a.cdb"), "");
  const Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.cycles(), (std::vector<long>{1, 2, 3}));
  for (const long cycle : archive.cycles()) {
    EXPECT_LE(bytesOfStep(archive, cycle), whole / 2);
    const std::string text = provenanceOf(archive, cycle);
    EXPECT_NE(
        text.find("; budget of " + std::to_string(whole / 2) + " bytes a step: quality level "),
        std::string::npos)
        << text;
    EXPECT_NE(text.find(" slabs, "), std::string::npos) << text;
    EXPECT_EQ(text.find("quality level 1 of"), std::string::npos) << text;
  }
  EXPECT_EQ(filesOf(folder / "a.cdb"), filesOf(folder / "b.cdb")) << "bytes alone: no timing";
}

TEST(BudgetSession, FixedKeysStayAndStepsThatCannotFitAreNotStored) {
  const Folder folder;
  Simulation run(folder / "a.cdb", budgeted("300", kStacks) + "[sliced]\nslabs = 6\n");
  EXPECT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  EXPECT_EQ(run.step(Sample(), 2), VESTIGE_OK) << run.error();
  EXPECT_EQ(vestige_stored_steps(run.session), 0);
  EXPECT_TRUE(run.logged("warning: cycle 1 is not stored"));
  EXPECT_TRUE(run.logged("warning: cycle 2 is not stored"));
  EXPECT_TRUE(run.logged("one stack of 6 slabs, 16 levels"));
  EXPECT_TRUE(Archive(folder / "a.cdb").rows().empty());
}

TEST(BudgetSession, ChoosesTheTierWhereNoneIsNamed) {
  const Folder folder;
  {
    Simulation run(folder / "a.cdb", budgeted("'1 MB'", ""));
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  // A grid as small as this one is stored as it is.
  const Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.proxies(), (std::vector<std::string>{"reference", "field"}));
  EXPECT_NE(provenanceOf(archive, 1).find("the field within 0.00781 of its range"),
            std::string::npos);
}

TEST(BudgetSession, ViewsShareTheBudget) {
  const Folder folder;
  const std::string image = "proxies = ['layered']\n[[view]]\nset = 'axes'\n";
  std::uintmax_t whole = 0;
  {
    Simulation run(folder / "whole.cdb", kSmallImage + image);
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
    whole = bytesOfStep(Archive(folder / "whole.cdb"), 1);
  }
  {
    Simulation run(folder / "a.cdb", budgeted(std::to_string(whole * 9 / 10), image));
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  const Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.views().size(), 6u);
  EXPECT_LE(bytesOfStep(archive, 1), whole * 9 / 10);
  EXPECT_NE(provenanceOf(archive, 1).find("pictures of 48 x 40, 2 layers"), std::string::npos);
}

TEST(BudgetSession, DryRunsSayWhichLevelTheyWouldTake) {
  const Folder folder;
  Simulation run(folder / "a.cdb",
                 "dry_run = true\n" + budgeted("'1 MB'\ntime_share = 0.5", kStacks));
  ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  EXPECT_TRUE(run.logged("dry run: [budget] takes quality level "));
  EXPECT_TRUE(run.logged("dry run: [budget] time_share = 0.5 allows such a step every "));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.cdb"));
}

TEST(BudgetSession, TimeShareLeavesOutStepsByTheClockItIsGiven) {
  const Folder folder;
  double now = 0.0;
  Log log;
  std::vector<long> wanted;
  {
    Config config = configFromText("[budget]\ntime_share = 0.25\n" + std::string(kSmallImage) +
                                       "proxies = ['mip']\n[trigger]\nevery_cycles = 2\n",
                                   "run.toml");
    config.output = folder / "a.cdb";
    // Each look at the clock takes a second, so that a step costs some.
    Session session(config, "", "", log, [&] { return now += 1.0; });
    const Sample sample;
    for (long cycle = 0; cycle < 80; ++cycle) {
      now += 2.0;
      if (!session.wants(cycle, double(cycle))) continue;
      wanted.push_back(cycle);
      session.blocks().describe(0, {.points = {24, 20, 16},
                                    .first = {},
                                    .origin = {},
                                    .spacing = {0.1, 0.1, 0.1},
                                    .axes = {},
                                    .ghosts = {}});
      FieldView field;
      field.name = "f";
      field.type = SampleType::Float32;
      field.location = Location::Point;
      field.components = {reinterpret_cast<const std::byte*>(sample.values.data())};
      field.strides = {4, 4 * 24, 4 * 24 * 20};
      session.blocks().share(0, std::move(field));
      session.execute(cycle, double(cycle));
    }
    EXPECT_EQ(session.storedSteps(), std::int64_t(wanted.size()));
  }
  // Of the forty even cycles some, the first one among them.
  EXPECT_EQ(wanted.front(), 0);
  EXPECT_LT(wanted.size(), 40u);
  EXPECT_GT(wanted.size(), 2u);
  EXPECT_TRUE(std::all_of(wanted.begin(), wanted.end(), [](long cycle) { return cycle % 2 == 0; }));
  EXPECT_EQ(cyclesOf(folder / "a.cdb"), wanted);
  const auto lines = log.take();
  const auto said = [&](const std::string& part) {
    return std::any_of(lines.begin(), lines.end(), [&](const auto& line) {
      return line.second.find(part) != std::string::npos;
    });
  };
  EXPECT_TRUE(said("is skipped, and more may be"));
  EXPECT_TRUE(said(" steps skipped before"));
}

}  // namespace
}  // namespace vestige::test
