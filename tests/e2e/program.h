// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vestige::test {

struct Outcome {
  int exitCode = -1;  ///< 128 + signal when killed by one
  std::string out, err;
};

/// A program of ours that runs in a folder of its own. Output goes to files, so nothing blocks.
class Program {
 public:
  /// `name` is a program of the build's bin folder. `environment` is added to ours.
  Program(const std::string& name, const std::vector<std::string>& arguments,
          const std::filesystem::path& folder,
          const std::map<std::string, std::string>& environment = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void signal(int number);
  /// What it has printed to standard output so far.
  std::string printed() const;
  Outcome wait();

 private:
  std::filesystem::path out_, err_;
  pid_t process_ = -1;
};

Outcome run(const std::string& name, const std::vector<std::string>& arguments,
            const std::filesystem::path& folder,
            const std::map<std::string, std::string>& environment = {});

/// Bytes of every file below `folder`, by relative path.
std::map<std::string, std::string> filesIn(const std::filesystem::path& folder);

std::string readFile(const std::filesystem::path& file);

}  // namespace vestige::test
