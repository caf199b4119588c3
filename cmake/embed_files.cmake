# cmake -DOUTPUT=made.cpp -DFUNCTION=name "-DFILES=a;b" -P embed_files.cmake
# writes a source file with the bytes of the files as raw string literals, sorted by name.
set(rows "")
list(SORT FILES)
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  file(READ ${file} bytes)
  string(FIND "${bytes}" ")embedded\"" clash)
  if(NOT clash EQUAL -1)
    message(FATAL_ERROR "${file} holds the end mark of a raw string")
  endif()
  string(APPEND rows "    {\"${name}\", R\"embedded(${bytes})embedded\"},\n")
endforeach()
file(WRITE ${OUTPUT} "// Made by cmake/embed_files.cmake.
#include <string_view>

namespace smoothpost {
namespace {
struct File {
  std::string_view name;
  std::string_view bytes;
};
constexpr File kFiles[] = {
${rows}};
}  // namespace

std::string_view ${FUNCTION}(std::string_view name);
std::string_view ${FUNCTION}(std::string_view name) {
  for (const File& file : kFiles)
    if (file.name == name) return file.bytes;
  return {};
}
}  // namespace smoothpost
")
