// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "proxy/base/error.h"

namespace vestige::test {

/// Memory that a reader may take beyond what the program has, whatever a file
/// claims.
inline constexpr std::size_t kMemoryBound = std::size_t(5) << 28;  // 1.25 GiB
inline constexpr unsigned kSecondsBound = 60;

/// Replaces a file. A new one each time: file systems flush one that is cut and written again.
inline void replaceFile(const std::filesystem::path& file, const std::string& bytes) {
  std::filesystem::remove(file);
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Why this reaction of a reader of `file` is wrong, or nothing: it may read
/// it, or refuse it with Format, NotFound or Io in a sentence of reasonable
/// length that names the file.
inline std::string complaint(const std::filesystem::path& file, const std::function<void()>& read,
                             bool mustRefuse = false) {
  try {
    read();
  } catch (const Error& e) {
    const std::string sentence = e.what();
    if (e.code() != ErrorCode::Format && e.code() != ErrorCode::NotFound &&
        e.code() != ErrorCode::Io)
      return "error code " + std::to_string(int(e.code())) + ": " + sentence;
    if (sentence.find(file.filename().string()) == std::string::npos)
      return "names no file: " + sentence;
    if (sentence.size() > 2000) return "says " + std::to_string(sentence.size()) + " bytes";
    return {};
  } catch (const std::exception& e) {
    return std::string("throws another exception: ") + e.what();
  }
  return mustRefuse ? "accepts it" : "";
}

/// Runs `work` in a child with bounded memory and time; returns what it
/// returns, or what killed it. Sanitizers need the whole address space: with
/// them it runs here, and they are the guard.
inline std::string contained(const std::function<std::string()>& work) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return work();
#else
  int ends[2];
  if (::pipe(ends) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child < 0) return "no fork";
  if (child == 0) {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t bytes = pages * std::size_t(::sysconf(_SC_PAGESIZE)) + kMemoryBound;
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &limit);
    ::alarm(kSecondsBound);
    std::string result;
    try {
      result = work();
    } catch (const std::exception& e) {
      result = e.what();
    }
    result.resize(std::min<std::size_t>(result.size(), 4000));
    const bool written = ::write(ends[1], result.data(), result.size()) == ssize_t(result.size());
    ::_exit(written ? 0 : 1);
  }
  ::close(ends[1]);
  std::string result(4096, '\0');
  std::size_t size = 0;
  for (ssize_t n; (n = ::read(ends[0], result.data() + size, result.size() - size)) > 0;)
    size += std::size_t(n);
  result.resize(size);
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) result += " killed by signal " + std::to_string(WTERMSIG(status));
  return result;
#endif
}

}  // namespace vestige::test
