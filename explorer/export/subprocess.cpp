// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/subprocess.h"

#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstring>

#include "proxy/base/error.h"

extern char** environ;

namespace vestige {

Subprocess::Subprocess(std::vector<std::string> arguments) : name_(arguments.at(0)) {
  // A socket rather than a pipe: writing to a program that died must not raise SIGPIPE in ours.
  int ends[2];
  output_ = memfd_create("vestige-subprocess", MFD_CLOEXEC);
  if (output_ < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    const int error = errno;
    if (output_ >= 0) close(output_);
    throw Error(ErrorCode::Io, name_ + " cannot be started: " + std::strerror(error));
  }
  input_ = ends[0];
  shutdown(ends[1], SHUT_WR);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output_, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output_, STDERR_FILENO);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int error = posix_spawnp(&pid_, name_.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) {
    pid_ = -1;
    closeInput();
    close(output_);
    throw Error(ErrorCode::NotFound, "'" + name_ + "' cannot be started: " + std::strerror(error) +
                                         "; install it or put it into PATH");
  }
}

Subprocess::~Subprocess() {
  closeInput();
  if (pid_ > 0) waitpid(pid_, nullptr, 0);
  if (output_ >= 0) close(output_);
}

void Subprocess::closeInput() {
  if (input_ >= 0) close(input_);
  input_ = -1;
}

std::string Subprocess::printed() const {
  std::string text(16384, '\0');
  const ssize_t count = pread(output_, text.data(), text.size(), 0);
  text.resize(count > 0 ? std::size_t(count) : 0);
  return text;
}

std::string Subprocess::reason() {
  // Programs end with what made them give up.
  std::string text = printed();
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  const std::size_t end = text.find_last_of("\r\n");
  if (end != std::string::npos) text.erase(0, end + 1);
  return text.empty() ? "nothing" : "'" + text + "'";
}

void Subprocess::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(input_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) {
      closeInput();
      if (pid_ > 0) waitpid(pid_, nullptr, 0);
      pid_ = -1;
      throw Error(ErrorCode::Io, name_ + " stopped before the end: it said " + reason());
    }
    bytes = bytes.subspan(std::size_t(sent));
  }
}

std::string Subprocess::finish() {
  closeInput();
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw Error(ErrorCode::Io, name_ + " failed: it said " + reason());
  }
  return printed();
}

}  // namespace vestige
