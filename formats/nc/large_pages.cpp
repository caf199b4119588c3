#include "formats/nc/large_pages.h"

#include <sys/mman.h>

#include <cstdlib>

namespace smoothpost::nc {

namespace {
constexpr std::size_t kLargePage = std::size_t{2} << 20;
}  // namespace

void* allocate_large(std::size_t bytes) {
  if (bytes < 2 * kLargePage) {
    void* memory = std::malloc(bytes > 0 ? bytes : 1);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
  }
  const std::size_t rounded = (bytes + kLargePage - 1) / kLargePage * kLargePage;
  void* memory = std::aligned_alloc(kLargePage, rounded);
  if (memory == nullptr) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  ::madvise(memory, rounded, MADV_HUGEPAGE);  // a hint: without large pages all is as before
#endif
  return memory;
}

void free_large(void* memory) noexcept { std::free(memory); }

}  // namespace smoothpost::nc
