#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace covol::detail {

/// Disjoint sets whose unions may be computed by any number of threads at once; each is represented by its smallest
/// member. Anderson and Woll, Wait-free parallel algorithms for the union-find problem, STOC 1991.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0U); }
    [[nodiscard]] std::size_t size() const noexcept { return parent_.size(); }
    /// The representative of a set. During concurrent unions the result may already be outdated.
    std::uint32_t root(std::uint32_t i) {
        for (;;) {
            const std::uint32_t parent = load(i);
            if (parent == i) return i;
            const std::uint32_t next = load(parent);
            // A node that is no longer a root never becomes one again, and unite() changes only the parents of roots. A
            // plain store is therefore sufficient.
            if (next != parent) std::atomic_ref(parent_[i]).store(next, std::memory_order_relaxed);
            i = next;
        }
    }
    void unite(std::uint32_t a, std::uint32_t b) {
        for (;;) {
            a = root(a);
            b = root(b);
            if (a == b) return;
            if (a < b) std::swap(a, b);
            std::uint32_t expected = a;
            if (std::atomic_ref(parent_[a]).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
        }
    }

private:
    std::uint32_t load(std::uint32_t i) { return std::atomic_ref(parent_[i]).load(std::memory_order_relaxed); }

    std::vector<std::uint32_t> parent_;
};

}  // namespace covol::detail
