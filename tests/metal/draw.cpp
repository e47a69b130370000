// Runs an exported search, SEARCH, for the rays of a file, as a fragment shader would: argv is rays, answers.
#include SEARCH

#include <cstdio>
#include <cstdlib>
#include <vector>

template <class T> std::vector<T> taken(FILE* from, size_t count) {
    std::vector<T> made(count);
    if (std::fread(made.data(), sizeof(T), count, from) != count) std::exit(2);
    return made;
}

int main(int, char** argv) {
    FILE* from = std::fopen(argv[1], "rb");
    const auto sizes = taken<int>(from, 4);  // columns, rows, wrap, rays
    const auto extent = taken<float>(from, 4);  // base, scale, tile size
    const auto texels = taken<float>(from, size_t(sizes[0]) * sizes[1]);
    const auto rays = taken<float>(from, size_t(sizes[3]) * 10);  // start, delta, cosine, light
    HeightInfo info = {};
    info.size = {float(sizes[0]), float(sizes[1])};
    info.base = extent[0];
    info.scale = extent[1];
    info.tile_size = {extent[2], extent[3]};
    info.wrap = uint(sizes[2]);
    const metal::texture2d<float, metal::access::sample> heights = {texels.data(), sizes[0], sizes[1], sizes[2]};
    FILE* to = std::fopen(argv[2], "wb");
    for (const float* r = rays.data(); r != rays.data() + rays.size(); r += 10) {
        const search_fragmentInput varyings = {{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6], {r[7], r[8], r[9]}};
        const metal::float4 found = search_fragment(varyings, heights, metal::sampler(), info).member;
        const float out[4] = {found.x, found.y, found.z, found.w};
        std::fwrite(out, sizeof(float), 4, to);
    }
    std::fclose(to);
}
