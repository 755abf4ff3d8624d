// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/api/worker.h"

#include <utility>

#include "proxy/gl/environment.h"

namespace vestige {

Worker::Worker() {
  const gl::SignalsBlocked blocked;
  thread_ = std::thread([this] { loop(); });
}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Worker::run(const std::function<void()>& work) {
  std::unique_lock lock(mutex_);
  work_ = &work;
  done_ = false;
  failure_ = nullptr;
  changed_.notify_all();
  changed_.wait(lock, [&] { return done_; });
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void Worker::loop() {
  gl::resetThread();
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return stop_ || work_; });
    if (!work_) return;
    const auto* work = std::exchange(work_, nullptr);
    lock.unlock();
    std::exception_ptr failure;
    try {
      (*work)();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
    done_ = true;
    changed_.notify_all();
  }
}

HostFloatingPoint::HostFloatingPoint() {
  std::fegetenv(&before_);
  std::fesetenv(FE_DFL_ENV);
}
HostFloatingPoint::~HostFloatingPoint() { std::fesetenv(&before_); }

}  // namespace vestige
