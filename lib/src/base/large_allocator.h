#pragma once
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <utility>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace covol::detail {

/// Memory for arrays that are traversed leaf by leaf: aligned to cache lines, and from some megabytes on to huge pages,
/// which are requested from the kernel. A sweep then causes few TLB misses, and the first access causes one page fault
/// per 2 MiB.
template <typename T>
struct LargeAllocator {
    using value_type = T;

    LargeAllocator() = default;
    template <typename U>
    LargeAllocator(const LargeAllocator<U>&) noexcept {}  // NOLINT: allocators convert implicitly

    [[nodiscard]] T* allocate(std::size_t count) {
        if (count > std::numeric_limits<std::size_t>::max() / 2 / sizeof(T)) throw std::bad_alloc();
        const bool is_large = count * sizeof(T) >= kLarge;
        const std::size_t unit = is_large ? kHugePage : kCacheLine;
        const std::size_t bytes = (count * sizeof(T) + unit - 1) / unit * unit;
        void* memory = std::aligned_alloc(unit, bytes);
        if (memory == nullptr) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
        if (is_large) madvise(memory, bytes, MADV_HUGEPAGE);  // errors are ignored: small pages only cost time
#endif
        return static_cast<T*>(memory);
    }
    /// Values without a constructor remain uninitialized, so that they can be initialized in parallel.
    template <typename U>
    void construct(U* at) noexcept {
        ::new (static_cast<void*>(at)) U;
    }
    template <typename U, typename... Arguments>
    void construct(U* at, Arguments&&... arguments) {
        ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
    void deallocate(T* memory, std::size_t) noexcept { std::free(memory); }

    bool operator==(const LargeAllocator&) const noexcept { return true; }

private:
    static constexpr std::size_t kCacheLine = 64, kHugePage = std::size_t(1) << 21, kLarge = 2 * kHugePage;
};

}  // namespace covol::detail
