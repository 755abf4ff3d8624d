// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cfenv>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace vestige {

/// One thread of ours with a clean floating-point environment, every processor and all signals
/// blocked, whatever the host has set on its own (docs/architecture.md, "Choices").
class Worker {
 public:
  Worker();
  /// Waits for the thread.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Runs `work` there and waits; its exception is rethrown here.
  void run(const std::function<void()>& work);

 private:
  void loop();

  std::mutex mutex_;
  std::condition_variable changed_;
  const std::function<void()>* work_ = nullptr;
  bool done_ = false;
  bool stop_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

/// The calling thread's floating-point environment, set aside while we work on that thread: traps
/// off and flags untouched afterwards.
class HostFloatingPoint {
 public:
  HostFloatingPoint();
  ~HostFloatingPoint();
  HostFloatingPoint(const HostFloatingPoint&) = delete;
  HostFloatingPoint& operator=(const HostFloatingPoint&) = delete;

 private:
  std::fenv_t before_;
};

}  // namespace vestige
