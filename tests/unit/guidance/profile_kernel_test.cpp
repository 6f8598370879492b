// Compares the kernels on profiles with plain loops that compute the same.
#include "guidance/profile_kernel.h"

#include <catch2/catch.hpp>
#include <random>
#include <vector>

using namespace covol::guidance;

namespace {

template <typename T>
std::vector<T> random_values(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<T> value(-1, 1);
    std::vector<T> values(count);
    for (T& v : values) v = value(random);
    return values;
}

}  // namespace

TEST_CASE("sum_of_products equals a plain sum for multiples of eight") {
    for (const std::size_t count : {0U, 8U, 16U, 24U, 504U}) {
        const std::vector<float> a = random_values<float>(count, 1), b = random_values<float>(count, 2);
        double expected = 0;
        for (std::size_t n = 0; n < count; ++n) expected += double(a[n]) * double(b[n]);
        CHECK(sum_of_products(a.data(), b.data(), count) == Approx(expected).margin(1e-5));
    }
}

TEST_CASE("add_weighted adds weighted values") {
    std::vector<double> sums = random_values<double>(37, 3);
    const std::vector<double> before = sums, values = random_values<double>(37, 4);
    add_weighted(sums.data(), values.data(), 0.3, sums.size());
    for (std::size_t n = 0; n < sums.size(); ++n) CHECK(sums[n] == Approx(before[n] + 0.3 * values[n]));
}

TEST_CASE("convolve equals a plain convolution and writes nothing beyond the last value") {
    for (const std::size_t count : {1U, 7U, 8U, 21U}) {
        const std::vector<float> kernel = random_values<float>(5, 5), line = random_values<float>(count + 4, 6);
        std::vector<float> out(count + 1, 9.0F);
        convolve(line.data(), kernel.data(), kernel.size(), out.data(), count);
        for (std::size_t n = 0; n < count; ++n) {
            double expected = 0;
            for (std::size_t k = 0; k < kernel.size(); ++k) expected += double(kernel[k]) * double(line[n + k]);
            CHECK(out[n] == Approx(expected).margin(1e-6));
        }
        CHECK(out[count] == 9.0F);
    }
}
