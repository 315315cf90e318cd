// SPDX-License-Identifier: MIT
// A C++ program outside the project: distances around a ring, with owners that free themselves.
#include <loxo/loxo.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <vector>

namespace
{
struct Free {
    void operator()(loxo_context *ctx) const { loxo_context_destroy(ctx); }
    void operator()(loxo_mesh *mesh) const { loxo_mesh_destroy(mesh); }
    void operator()(loxo_geodesic *geodesic) const { loxo_geodesic_destroy(geodesic); }
};

loxo_status check(const loxo_context *ctx, loxo_status status)
{
    if (status < 0) throw std::runtime_error(ctx != nullptr ? loxo_context_failure(ctx)->text : "no context");
    return status;
}

int run()
{
    const int around = 120, along = 40;
    const double pi = std::acos(-1.0), step = 2.0 * pi / around;
    std::vector<double> position;
    std::vector<loxo_index> triangle;
    for (int i = 0; i < along; ++i) {
        for (int k = 0; k < around; ++k) {
            const double angle = step * (k + 0.5 * (i % 2));
            for (double x : {std::cos(angle), std::sin(angle), step * std::sqrt(0.75) * i})
                position.push_back(x);
        }
    }
    for (int i = 0; i + 1 < along; ++i) {
        for (int k = 0; k < around; ++k) {
            const int next = (k + 1) % around, a = i * around + k, b = i * around + next, c = a + around,
                      d = b + around;
            const int even[6] = {a, b, c, b, d, c}, odd[6] = {a, b, d, a, d, c};
            for (int v : i % 2 == 0 ? even : odd)
                triangle.push_back(static_cast<loxo_index>(v));
        }
    }

    loxo_context *raw_ctx = nullptr;
    check(nullptr, loxo_context_create(nullptr, &raw_ctx));
    const std::unique_ptr<loxo_context, Free> ctx(raw_ctx);

    loxo_mesh_arrays arrays = {};
    arrays.n_vertices = static_cast<int64_t>(position.size() / 3);
    arrays.n_faces = static_cast<int64_t>(triangle.size() / 3);
    arrays.position = position.data();
    arrays.triangle = triangle.data();
    loxo_mesh *raw_mesh = nullptr;
    check(ctx.get(), loxo_mesh_create(ctx.get(), &arrays, LOXO_BORROW, nullptr, nullptr, &raw_mesh));
    const std::unique_ptr<loxo_mesh, Free> mesh(raw_mesh);

    const loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    loxo_geodesic *raw_geodesic = nullptr;
    check(ctx.get(), loxo_geodesic_create(ctx.get(), mesh.get(), &settings, &raw_geodesic));
    const std::unique_ptr<loxo_geodesic, Free> geodesic(raw_geodesic);

    // Half-way round the ring is pi, whichever vertex one starts from.
    std::vector<double> distance(position.size() / 3);
    double worst = 0.0;
    for (int start : {0, around / 3}) {
        const loxo_index source = static_cast<loxo_index>(start);
        check(ctx.get(), loxo_geodesic_solve(geodesic.get(), &source, 1, distance.data(), nullptr));
        const double error = std::fabs(distance[static_cast<std::size_t>((start + around / 2) % around)] - pi);
        if (!(error <= worst)) worst = error;
    }
    std::printf("loxo %s: %zu vertices, half a turn is off pi by %.4f\n", loxo_version(), distance.size(), worst);
    return worst < 0.1 ? 0 : 1;
}
} // namespace

int main()
{
    try {
        return run();
    } catch (const std::exception &e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
