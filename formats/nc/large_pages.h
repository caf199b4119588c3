#pragma once

#include <cstddef>
#include <new>

namespace smoothpost::nc {

/// `bytes` of memory; big blocks are aligned for, and offered, the system's large pages. Freed by
/// free_large. Throws std::bad_alloc.
///
/// A program of a million lines has a hundred thousand small pages of pieces; the first touch of
/// each costs more than reading the words that stand in it.
void* allocate_large(std::size_t bytes);
void free_large(void* memory) noexcept;

/// Allocator of the vectors that grow with the program.
template <class T>
struct LargePageAllocator {
  using value_type = T;
  LargePageAllocator() = default;
  template <class U>
  LargePageAllocator(const LargePageAllocator<U>&) noexcept {
  }  // NOLINT(google-explicit-constructor)
  T* allocate(std::size_t n) { return static_cast<T*>(allocate_large(n * sizeof(T))); }
  void deallocate(T* memory, std::size_t) noexcept { free_large(memory); }
  template <class U>
  bool operator==(const LargePageAllocator<U>&) const noexcept {
    return true;
  }
};

}  // namespace smoothpost::nc
