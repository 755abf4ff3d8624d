// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/gl/program.h"

#include <charconv>
#include <optional>

#include "proxy/base/error.h"

namespace vestige::gl {
namespace {

const char* stageName(GLenum type) {
  switch (type) {
    case GL_VERTEX_SHADER:
      return "vertex";
    case GL_FRAGMENT_SHADER:
      return "fragment";
    case GL_COMPUTE_SHADER:
      return "compute";
    case GL_GEOMETRY_SHADER:
      return "geometry";
    default:
      return "unknown";
  }
}

/// The source with `defines` after its #version line and line numbers kept as in the file.
std::string withDefines(std::string_view source,
                        const std::vector<std::pair<std::string, std::string>>& defines) {
  if (defines.empty()) return std::string(source);
  std::size_t insert = source.find("#version");
  if (insert == std::string_view::npos) {
    throw Error(ErrorCode::Internal, "a shader has no #version line");
  }
  insert = source.find('\n', insert);
  if (insert == std::string_view::npos) insert = source.size();
  std::size_t line = 1;
  for (char c : source.substr(0, insert)) line += c == '\n';

  std::string text(source.substr(0, insert));
  for (const auto& [name, value] : defines) text += "\n#define " + name + " " + value;
  text += "\n#line " + std::to_string(line + 1);
  text += source.substr(insert);
  return text;
}

/// The line that the first message of Mesa's ("0:12(3): error: …") or another compiler's log
/// ("ERROR: 0:12: …") is about.
std::optional<int> lineOf(const std::string& log) {
  const auto at = log.find("0:");
  if (at == std::string::npos) return std::nullopt;
  int line = 0;
  const char* begin = log.data() + at + 2;
  const auto [end, error] = std::from_chars(begin, log.data() + log.size(), line);
  if (error != std::errc() || end == begin) return std::nullopt;
  return line;
}

std::string_view sourceLine(std::string_view source, int number) {
  for (int i = 1; i < number; ++i) {
    const auto end = source.find('\n');
    if (end == std::string_view::npos) return {};
    source.remove_prefix(end + 1);
  }
  return source.substr(0, source.find('\n'));
}

std::string trimmed(std::string log) {
  while (!log.empty() && (log.back() == '\n' || log.back() == '\0' || log.back() == ' ')) {
    log.pop_back();
  }
  return log;
}

std::string shaderLog(GLuint shader) {
  GLint length = 0;
  functions().GetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
  std::string log(std::size_t(length > 0 ? length : 0), '\0');
  if (length > 0) functions().GetShaderInfoLog(shader, length, nullptr, log.data());
  return trimmed(log);
}

std::string programLog(GLuint program) {
  GLint length = 0;
  functions().GetProgramiv(program, GL_INFO_LOG_LENGTH, &length);
  std::string log(std::size_t(length > 0 ? length : 0), '\0');
  if (length > 0) functions().GetProgramInfoLog(program, length, nullptr, log.data());
  return trimmed(log);
}

void attachStage(GLuint program, const Program::Stage& stage,
                 const std::vector<std::pair<std::string, std::string>>& defines) {
  const Functions& gl = functions();
  const std::string text = withDefines(stage.source, defines);
  const char* pointer = text.c_str();
  const GLint length = GLint(text.size());
  const GLuint shader = gl.CreateShader(stage.type);
  gl.ShaderSource(shader, 1, &pointer, &length);
  gl.CompileShader(shader);
  GLint compiled = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (!compiled) {
    const std::string log = shaderLog(shader);
    gl.DeleteShader(shader);
    std::string sentence =
        std::string("a ") + stageName(stage.type) + " shader does not compile: " + log;
    if (const auto line = lineOf(log)) {
      sentence += " (line " + std::to_string(*line) + ": " +
                  std::string(sourceLine(stage.source, *line)) + ")";
    }
    throw Error(ErrorCode::Gl, sentence);
  }
  gl.AttachShader(program, shader);
  gl.DeleteShader(shader);  // lives on as a part of the program
}

}  // namespace

Program::Program(const std::vector<Stage>& stages,
                 const std::vector<std::pair<std::string, std::string>>& defines)
    : id_(functions().CreateProgram()) {
  const Functions& gl = functions();
  try {
    for (const Stage& stage : stages) attachStage(id_, stage, defines);
    gl.LinkProgram(id_);
    GLint linked = 0;
    gl.GetProgramiv(id_, GL_LINK_STATUS, &linked);
    if (!linked) {
      throw Error(ErrorCode::Gl, "a shader program does not link: " + programLog(id_));
    }
  } catch (...) {
    gl.DeleteProgram(id_);
    throw;
  }
}

Program::~Program() {
  if (id_) functions().DeleteProgram(id_);
}
Program::Program(Program&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
Program& Program::operator=(Program&& other) noexcept {
  std::swap(id_, other.id_);
  return *this;
}

void Program::use() const { functions().UseProgram(id_); }
GLint Program::uniform(const char* name) const { return functions().GetUniformLocation(id_, name); }

}  // namespace vestige::gl
