# SPDX-License-Identifier: BSD-3-Clause
file(READ "${INPUT}" text)
file(WRITE "${STEM}.h" "#pragma once
#include <string_view>
namespace vestige::embedded {
extern const std::string_view ${NAME};
}
")
file(WRITE "${STEM}.cpp" "#include \"${NAME}.embed.h\"
namespace vestige::embedded {
const std::string_view ${NAME} = R\"embed(${text})embed\";
}
")
