# SPDX-License-Identifier: BSD-3-Clause
# The installed package: find_package(vestige COMPONENTS adaptor|proxy|explorer).
