// SPDX-License-Identifier: BSD-3-Clause
#include "simulation.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "proxy/archive/archive.h"

namespace vestige::test {

Folder::Folder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "vestige_test_XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}
Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Sample::Sample(std::array<int, 3> s) : size(s) {
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) {
        values.push_back(float(std::sin(0.3 * x) * std::cos(0.4 * y) + 0.1 * z));
      }
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    grid.points[a] = size[a];
    grid.spacing[a] = 1.0 / std::max(1, size[a] - 1);
  }
}

Simulation::Simulation(const std::string& output, const std::string& config) {
  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.config_text = config.c_str();
  options.output = output.c_str();
  options.log = [](int level, const char* sentence, void* data) {
    static constexpr std::array<const char*, 3> kLevels{"info: ", "warning: ", "error: "};
    static_cast<Simulation*>(data)->log.push_back(std::string(kLevels[std::size_t(level)]) +
                                                  sentence);
  };
  options.log_data = this;
  opened = vestige_open(&options, &session);
}

int Simulation::step(const Sample& sample, int64_t cycle) {
  vestige_block(session, 0, &sample.grid);
  vestige_share_field(session, 0, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1, sample.values.data(),
                      nullptr);
  return vestige_execute(session, cycle, 0.1 * double(cycle));
}

bool Simulation::logged(const std::string& part) const {
  for (const auto& line : log) {
    if (line.find(part) != std::string::npos) return true;
  }
  return false;
}

std::map<std::string, std::string> filesOf(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().filename() == "timings.csv") continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files[entry.path().lexically_relative(folder).string()] =
        std::string(std::istreambuf_iterator<char>(stream), {});
  }
  return files;
}

std::string damageOf(const std::string& archive) {
  std::string text;
  for (const auto& finding : checkArchive(archive)) {
    if (!finding.leftover) text += finding.file + ": " + finding.problem + "\n";
  }
  return text;
}

std::vector<long> cyclesOf(const std::string& archive) { return Archive(archive).cycles(); }

std::string inChild(const std::function<std::string()>& work) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = fork();
  if (child < 0) return "no fork";
  if (child == 0) {
    close(ends[0]);
    std::string result;
    try {
      result = work();
    } catch (const std::exception& error) {
      result = std::string("exception: ") + error.what();
    }
    const auto* from = result.data();
    for (auto left = result.size(); left > 0;) {
      const auto sent = write(ends[1], from, left);
      if (sent <= 0) break;
      from += sent;
      left -= std::size_t(sent);
    }
    _exit(result.empty() ? 0 : 1);
  }
  close(ends[1]);
  std::string result;
  char buffer[4096];
  for (ssize_t got = 0; (got = read(ends[0], buffer, sizeof buffer)) > 0;) {
    result.append(buffer, std::size_t(got));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) {
    result += std::string("killed by ") + strsignal(WTERMSIG(status));
  } else if (WEXITSTATUS(status) != 0 && result.empty()) {
    result = "exit code " + std::to_string(WEXITSTATUS(status));
  }
  return result;
}

}  // namespace vestige::test
