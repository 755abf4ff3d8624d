// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/gl/environment.h"

#include <pthread.h>
#include <pwd.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cfenv>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <vector>

namespace vestige::gl {

SignalsBlocked::SignalsBlocked() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before_);
}
SignalsBlocked::~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

void resetThread() {
  std::fesetenv(FE_DFL_ENV);
  // The kernel intersects this with what a cpuset or container allows.
  cpu_set_t all;
  std::memset(&all, 0xff, sizeof all);
  sched_setaffinity(0, sizeof all, &all);
}

int allowedProcessors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  const int count = CPU_COUNT(&set);
  return count > 0 ? count : 1;
}

bool hasShaderCache() {
  // As Mesa does: the folder, not those above it. Permissions alone do not say it, least of all to
  // root.
  const auto usable = [](const std::string& path) {
    struct stat there;
    return ::mkdir(path.c_str(), 0755) == 0 ||
           (::stat(path.c_str(), &there) == 0 && S_ISDIR(there.st_mode) &&
            ::access(path.c_str(), W_OK | X_OK) == 0);
  };
  for (const char* name : {"MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR", "XDG_CACHE_HOME"}) {
    const char* chosen = std::getenv(name);
    if (chosen) return usable(chosen);
  }
  std::vector<char> buffer(1 << 14);
  passwd entry{};
  passwd* user = nullptr;
  return getpwuid_r(getuid(), &entry, buffer.data(), buffer.size(), &user) == 0 && user &&
         usable(std::string(user->pw_dir) + "/.cache");
}

ScopedEnvironment::ScopedEnvironment(const std::string& name, const std::string& value)
    : name_(name), before_(environ) {
  // Kept reachable for ever: a reader on another thread may still walk an old copy.
  static std::mutex mutex;
  static auto& copies = *new std::vector<std::unique_ptr<std::vector<char*>>>();
  static auto& entries = *new std::vector<std::unique_ptr<std::string>>();
  const std::lock_guard lock(mutex);

  const std::string prefix = name + "=";
  entries.push_back(std::make_unique<std::string>(prefix + value));
  auto copy = std::make_unique<std::vector<char*>>();
  copy->push_back(entries.back()->data());
  for (char** entry = before_; entry && *entry; ++entry) {
    if (std::strncmp(*entry, prefix.c_str(), prefix.size()) != 0) copy->push_back(*entry);
  }
  copy->push_back(nullptr);
  during_ = copy->data();
  copies.push_back(std::move(copy));
  environ = during_;
}

ScopedEnvironment::~ScopedEnvironment() {
  if (environ == during_) {
    environ = before_;
  } else {
    // Someone called setenv meanwhile, which made the C library take a copy of ours: keep their
    // change and take only our entry out.
    unsetenv(name_.c_str());
  }
}

}  // namespace vestige::gl
