// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <string>

#include "adaptor/include/vestige.h"

namespace vestige {
namespace {

TEST(NoGl, IsToldAndDisablesTheSession) {
  // Opening a library needs a file descriptor; a dry run needs none before that.
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit none = before;
  none.rlim_cur = 0;
  setrlimit(RLIMIT_NOFILE, &none);
  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.config_text = "dry_run = true\n";
  vestige_session* session = nullptr;
  const int code = vestige_open(&options, &session);
  setrlimit(RLIMIT_NOFILE, &before);

  EXPECT_EQ(code, VESTIGE_ERROR_NO_GL) << vestige_last_error(session);
  EXPECT_NE(std::string(vestige_last_error(session)).find("OSMesa"), std::string::npos)
      << vestige_last_error(session);
  EXPECT_EQ(vestige_wants(session, 0, 0.0), 0);
  EXPECT_EQ(vestige_execute(session, 0, 0.0), VESTIGE_ERROR_NO_GL);
  EXPECT_EQ(vestige_close(session), VESTIGE_ERROR_NO_GL);
}

}  // namespace
}  // namespace vestige
