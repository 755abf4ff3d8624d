// SPDX-License-Identifier: BSD-3-Clause
//
// Every code of the C API, provoked through it. INTERNAL is a fault of ours by definition:
// error_code_test.cpp covers its conversion. NO_GL is in no_gl_test.cpp, MEMORY in
// hosts_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "simulation.h"

namespace vestige::test {
namespace {

/// Expects a call's code and a part of the sentence.
void expectError(const Simulation& run, int result, int code, const std::string& part) {
  EXPECT_EQ(result, code) << vestige_code_name(result) << ": " << run.error();
  EXPECT_NE(run.error().find(part), std::string::npos) << run.error();
  EXPECT_TRUE(run.logged("error: ")) << "errors are logged, too";
}

/// Expects that a session cannot be opened, and that it stays harmless.
void expectRefused(Simulation& run, int code, const std::string& part) {
  expectError(run, run.opened, code, part);
  const Sample sample;
  ASSERT_NE(run.session, nullptr);
  EXPECT_EQ(vestige_wants(run.session, 0, 0.0), 0);
  EXPECT_EQ(run.step(sample, 0), code);
  EXPECT_EQ(vestige_stored_steps(run.session), 0);
}

TEST(Errors, NullSessionsAndArgumentsAreHarmless) {
  const Sample sample;
  EXPECT_EQ(vestige_open(nullptr, nullptr), VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_block(nullptr, 0, &sample.grid), VESTIGE_ERROR_ARGUMENT);
  EXPECT_STREQ(vestige_last_error(nullptr), "the session is NULL");
  EXPECT_EQ(vestige_domain(nullptr, nullptr, nullptr), VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_share_field(nullptr, 0, "f", 0, 0, 1, nullptr, nullptr),
            VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_share_components(nullptr, 0, "f", 0, 0, 1, nullptr, nullptr),
            VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_share_mask(nullptr, 0, 0, nullptr, 0, nullptr), VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_units(nullptr, "f", "K"), VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_execute(nullptr, 0, 0.0), VESTIGE_ERROR_ARGUMENT);
  EXPECT_EQ(vestige_wants(nullptr, 0, 0.0), 0);
  EXPECT_EQ(vestige_stored_steps(nullptr), 0);
  EXPECT_EQ(vestige_close(nullptr), VESTIGE_OK);
}

TEST(Errors, ArgumentsOutOfRange) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  auto* s = run.session;
  const float* data = sample.values.data();
  ASSERT_EQ(vestige_block(s, 0, &sample.grid), VESTIGE_OK);
  const auto share = [&](const char* name, int type, int location, int components,
                         const void* values) {
    return vestige_share_field(s, 0, name, type, location, components, values, nullptr);
  };
  const int bad = VESTIGE_ERROR_ARGUMENT;
  expectError(run, share(nullptr, 0, 0, 1, data), bad, "needs a name");
  expectError(run, share("", 0, 0, 1, data), bad, "needs a name");
  expectError(run, share("f", 10, 0, 1, data), bad, "type 10");
  expectError(run, share("f", -1, 0, 1, data), bad, "type -1");
  expectError(run, share("f", 0, 2, 1, data), bad, "location 2");
  expectError(run, share("f", 0, 0, 0, data), bad, "0 components");
  expectError(run, share("f", 0, 0, 65, data), bad, "65 components");
  expectError(run, share("f", 0, 0, 1, nullptr), bad, "data is NULL");
  const void* components[] = {data, nullptr};
  expectError(run, vestige_share_components(s, 0, "f", 0, 0, 2, components, nullptr), bad,
              "component 1 is NULL");
  expectError(run, vestige_share_mask(s, 0, 5, nullptr, 0, nullptr), bad, "location 5");
  expectError(run, vestige_units(s, "f", nullptr), bad, "NULL");
  expectError(run, vestige_domain(s, nullptr, nullptr), bad, "NULL");
  expectError(run, vestige_block(s, 0, nullptr), bad, "NULL");
  expectError(run, vestige_block(s, -1, &sample.grid), bad, "-1");
  EXPECT_EQ(run.step(sample, 0), VESTIGE_OK) << "bad calls lose nothing: " << run.error();
}

TEST(Errors, ConfigThatDoesNotParse) {
  const Folder folder;
  Simulation run(folder / "a.cdb", "[image]\nwidht = 3\n");
  expectRefused(run, VESTIGE_ERROR_CONFIG, "config:2: [image] widht: unknown key");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Errors, ConfigFileIsNamedInItsErrors) {
  const Folder folder;
  const std::string file = folder / "run.toml";
  std::ofstream(file) << "[image\n";
  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.config = file.c_str();
  vestige_session* session = nullptr;
  EXPECT_EQ(vestige_open(&options, &session), VESTIGE_ERROR_CONFIG);
  EXPECT_NE(std::string(vestige_last_error(session)).find("run.toml:1:"), std::string::npos);
  vestige_close(session);

  options.config = "/nowhere/run.toml";
  EXPECT_EQ(vestige_open(&options, &session), VESTIGE_ERROR_NOT_FOUND);
  vestige_close(session);

  options.config_text = "";
  EXPECT_EQ(vestige_open(&options, &session), VESTIGE_ERROR_ARGUMENT);
  vestige_close(session);
}

TEST(Errors, ArchiveThatExistsIsRefusedAndUntouched) {
  const Folder folder;
  const Sample sample;
  {
    Simulation run(folder / "a.cdb");
    ASSERT_EQ(run.step(sample, 0), VESTIGE_OK) << run.error();
  }
  const auto before = filesOf(folder / "a.cdb");
  Simulation run(folder / "a.cdb");
  expectRefused(run, VESTIGE_ERROR_EXISTS, "a.cdb");
  EXPECT_EQ(filesOf(folder / "a.cdb"), before);

  std::filesystem::create_directory(folder / "photos");
  std::ofstream(folder / "photos/cat.jpg") << "cat";
  Simulation other(folder / "photos", "[output]\nexisting = 'overwrite'\n");
  expectRefused(other, VESTIGE_ERROR_EXISTS, "photos");
  EXPECT_TRUE(std::filesystem::exists(folder / "photos/cat.jpg"));
}

TEST(Errors, DamagedArchiveIsNotAppendedTo) {
  const Folder folder;
  const Sample sample;
  {
    Simulation run(folder / "a.cdb");
    ASSERT_EQ(run.step(sample, 0), VESTIGE_OK) << run.error();
  }
  std::ofstream(folder / "a.cdb/data.csv") << "a,b,c\n1,2\n3,4\n";
  Simulation run(folder / "a.cdb", "[output]\nexisting = 'append'\n");
  expectRefused(run, VESTIGE_ERROR_FORMAT, "data.csv");
}

TEST(Errors, ArchiveThatCannotBeMade) {
  Simulation run("/proc/vestige.cdb");
  expectRefused(run, VESTIGE_ERROR_IO, "/proc/vestige.cdb");
}

TEST(Errors, BlockThatNoDeviceHolds) {
  const Folder folder;
  Simulation run(folder / "a.cdb");
  vestige_grid grid = VESTIGE_GRID_INIT;
  grid.points[0] = 1 << 30;
  grid.points[1] = grid.points[2] = 2;
  expectError(run, vestige_block(run.session, 0, &grid), VESTIGE_ERROR_GRID,
              "block 0 has 1073741824 x 2 x 2 points, more than a block can have");
  // Coordinates are not read before.
  const double axis[] = {0.0, 1.0};
  grid.axes[0] = axis;
  expectError(run, vestige_block(run.session, 0, &grid), VESTIGE_ERROR_GRID, "1073741824");
  EXPECT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
}

TEST(Errors, FieldsAtPointsAndAtCellsOfOneName) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  auto* s = run.session;
  vestige_block(s, 0, &sample.grid);
  const auto share = [&](int location) {
    return vestige_share_field(s, 0, "f", VESTIGE_FLOAT32, location, 1, sample.values.data(),
                               nullptr);
  };
  EXPECT_EQ(share(VESTIGE_POINT), VESTIGE_OK);
  EXPECT_EQ(share(VESTIGE_POINT), VESTIGE_OK) << "shared anew";
  expectError(run, share(VESTIGE_CELL), VESTIGE_ERROR_FIELD,
              "field 'f' of block 0 is shared at points already");
  EXPECT_EQ(vestige_execute(s, 0, 0.0), VESTIGE_OK) << "the first one is stored: " << run.error();
  vestige_share_field(s, 0, "f", VESTIGE_FLOAT32, VESTIGE_CELL, 1, sample.values.data(), nullptr);
  EXPECT_EQ(vestige_execute(s, 1, 0.1), VESTIGE_OK) << run.error();
}

TEST(Errors, ReportsOfImportersAreLogged) {
  const Folder folder;
  Simulation run(folder / "a.cdb");
  auto* s = run.session;
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(vestige_report(s, VESTIGE_OK, "a part is missing"), VESTIGE_OK);
  EXPECT_EQ(std::count(run.log.begin(), run.log.end(), "warning: a part is missing"), 1);
  expectError(run, vestige_report(s, VESTIGE_ERROR_FIELD, "no tuples"), VESTIGE_ERROR_FIELD,
              "no tuples");
  expectError(run, vestige_report(s, 99, "?"), VESTIGE_ERROR_ARGUMENT, "99 is no vestige_code");
  expectError(run, vestige_report(s, VESTIGE_OK, nullptr), VESTIGE_ERROR_ARGUMENT, "no sentence");
  EXPECT_EQ(vestige_report(nullptr, VESTIGE_OK, "?"), VESTIGE_ERROR_ARGUMENT);
}

TEST(Errors, CloseSaysHowTheRunEnded) {
  const Folder folder;
  const Sample sample;
  const std::string config = std::string(kSmallImage) + "[[field]]\nsource = 'g'\n";
  Simulation lost(folder / "a.cdb", config);
  EXPECT_EQ(lost.step(sample, 0), VESTIGE_ERROR_NO_FIELD);
  EXPECT_EQ(vestige_close(std::exchange(lost.session, nullptr)), VESTIGE_ERROR_NO_FIELD);
  Simulation fine(folder / "b.cdb");
  vestige_execute(fine.session, 0, 0.0);
  EXPECT_EQ(fine.step(sample, 1), VESTIGE_OK) << fine.error();
  EXPECT_EQ(vestige_close(std::exchange(fine.session, nullptr)), VESTIGE_OK);
}

TEST(Errors, CommunicatorWithoutMpi) {
  const Folder folder;
  const std::string output = folder / "a.cdb";
  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.output = output.c_str();
  options.mpi_comm = 0;
  vestige_session* session = nullptr;
  EXPECT_EQ(vestige_open(&options, &session), VESTIGE_ERROR_MPI);
  EXPECT_NE(std::string(vestige_last_error(session)).find("built without MPI"), std::string::npos);
  vestige_close(session);
}

TEST(Errors, StructsOfAnotherVersion) {
  const Folder folder;
  const std::string output = folder / "a.cdb";
  vestige_session* session = nullptr;
  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.output = output.c_str();
  options.size = 8;
  EXPECT_EQ(vestige_open(&options, &session), VESTIGE_ERROR_VERSION);
  vestige_close(session);
  options = VESTIGE_OPTIONS_INIT;
  options.flags = VESTIGE_QUIET | 64;
  EXPECT_EQ(vestige_open(&options, &session), VESTIGE_ERROR_VERSION);
  vestige_close(session);

  // A newer header: accepted as long as what it appended is unset.
  struct Newer {
    vestige_options known;
    void* appended;
  } newer{VESTIGE_OPTIONS_INIT, &newer};
  newer.known.output = output.c_str();
  newer.known.size = sizeof newer;
  EXPECT_EQ(vestige_open(&newer.known, &session), VESTIGE_ERROR_VERSION);
  vestige_close(session);
  newer.appended = nullptr;
  EXPECT_EQ(vestige_open(&newer.known, &session), VESTIGE_OK) << vestige_last_error(session);
  vestige_grid grid = VESTIGE_GRID_INIT;
  grid.size = 3;
  EXPECT_EQ(vestige_block(session, 0, &grid), VESTIGE_ERROR_VERSION);
  struct NewerGrid {
    vestige_grid known;
    double appended;
  } newerGrid{VESTIGE_GRID_INIT, 1.0};
  newerGrid.known.size = sizeof newerGrid;
  EXPECT_EQ(vestige_block(session, 0, &newerGrid.known), VESTIGE_ERROR_VERSION);
  newerGrid.appended = 0.0;
  EXPECT_EQ(vestige_block(session, 0, &newerGrid.known), VESTIGE_OK);
  vestige_close(session);
}

TEST(Errors, GridsBlocksAndFieldsThatDoNotFit) {
  const Folder folder;
  Sample sample;
  Simulation run(folder / "a.cdb");
  auto* s = run.session;
  expectError(run, vestige_execute(s, 0, 0.0), VESTIGE_ERROR_GRID, "no block has any points");
  vestige_grid wrong = sample.grid;
  wrong.spacing[2] = std::nan("");
  expectError(run, vestige_block(s, 0, &wrong), VESTIGE_ERROR_GRID, "spacing nan along z");
  const double low[] = {0, 0, 0}, nan[] = {1, 1, std::nan("")};
  expectError(run, vestige_domain(s, low, nan), VESTIGE_ERROR_GRID, "nan along z");
  expectError(run, vestige_share_field(s, 4, "f", 0, 0, 1, sample.values.data(), nullptr),
              VESTIGE_ERROR_NO_BLOCK, "block 4");
  vestige_block(s, 0, &sample.grid);
  expectError(run, vestige_execute(s, 0, 0.0), VESTIGE_ERROR_NO_FIELD, "no field is shared");

  // A second block beside the first.
  vestige_grid beside = sample.grid;
  beside.first[0] = sample.size[0] - 1;
  const auto share = [&](int block, int location, int components) {
    vestige_share_field(s, block, "f", VESTIGE_FLOAT32, location, components, sample.values.data(),
                        nullptr);
  };
  vestige_block(s, 1, &beside);
  share(0, VESTIGE_POINT, 1);
  expectError(run, vestige_execute(s, 0, 0.0), VESTIGE_ERROR_NO_FIELD,
              "field 'f' is not shared for block 1");
  share(0, VESTIGE_POINT, 1);
  share(1, VESTIGE_CELL, 1);
  expectError(run, vestige_execute(s, 0, 0.0), VESTIGE_ERROR_FIELD, "in block 1");
  beside.first[0] = 3;
  vestige_block(s, 1, &beside);
  share(0, VESTIGE_POINT, 1);
  share(1, VESTIGE_POINT, 1);
  expectError(run, vestige_execute(s, 0, 0.0), VESTIGE_ERROR_GRID, "block 1 overlaps block 0");
}

TEST(Errors, FieldsThatTheConfigWantsOtherwise) {
  const Folder folder;
  const Sample sample;
  Simulation missing(folder / "a.cdb", std::string(kSmallImage) + "[[field]]\nsource = 'ff'\n");
  expectError(missing, missing.step(sample, 0), VESTIGE_ERROR_NO_FIELD, "did you mean 'f'?");
  Simulation component(folder / "b.cdb",
                       std::string(kSmallImage) + "[[field]]\nsource = 'f'\ncomponent = 1\n");
  expectError(component, component.step(sample, 0), VESTIGE_ERROR_FIELD, "component 1");
  Simulation twice(folder / "c.cdb",
                   std::string(kSmallImage) + "[[field]]\nsource = 'f'\n[[field]]\nname = 'f'\n");
  expectError(twice, twice.step(sample, 0), VESTIGE_ERROR_FIELD, "two fields are called 'f'");
}

TEST(Errors, CyclesThatDoNotIncreaseAndTimesThatAreNoNumbers) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  ASSERT_EQ(run.step(sample, 5), VESTIGE_OK) << run.error();
  expectError(run, run.step(sample, 5), VESTIGE_ERROR_CYCLE, "cycle 5 is not after");
  expectError(run, run.step(sample, 4), VESTIGE_ERROR_CYCLE, "cycle 4 is not after");
  expectError(run, vestige_execute(run.session, 6, std::nan("")), VESTIGE_ERROR_CYCLE, "nan");
  EXPECT_EQ(run.step(sample, 7), VESTIGE_OK) << run.error();
}

TEST(Errors, EveryCodeHasAName) {
  for (int code = 0; code <= VESTIGE_ERROR_CYCLE; ++code) {
    EXPECT_EQ(std::string(vestige_code_name(code)).rfind("VESTIGE_", 0), 0u) << code;
  }
  EXPECT_STREQ(vestige_code_name(VESTIGE_ERROR_CYCLE + 1), "unknown code");
  EXPECT_STREQ(vestige_code_name(-1), "unknown code");
}

}  // namespace
}  // namespace vestige::test
