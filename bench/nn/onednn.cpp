// The forward pass of the same networks by oneDNN, one thread: its own packing of the weights, ReLU and the skip fused
// into the layers, and the batch that suits it best.
//   bench_nn_onednn      one line of JSON: nanoseconds a sample by width
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <dnnl.hpp>
#include <limits>
#include <vector>

namespace {

constexpr int kLayers = 6;  // in, two residual blocks of two, out

class Net {
 public:
  Net(int width, int batch) : m_engine(dnnl::engine::kind::cpu, 0), m_stream(m_engine) {
    using Tag = dnnl::memory::format_tag;
    const dnnl::memory::dims shape{batch, width}, weights{width, width};
    const auto any = [](const dnnl::memory::dims& dims) {
      return dnnl::memory::desc(dims, dnnl::memory::data_type::f32, Tag::any);
    };
    const dnnl::memory::desc plain(shape, dnnl::memory::data_type::f32, Tag::nc),
        bias({width}, dnnl::memory::data_type::f32, Tag::x);
    for (dnnl::memory& x : m_x) x = filled(plain, 0.5f);
    // Which of the three arrays a layer reads and writes; the second layer of a block adds to what it writes.
    constexpr int kFrom[kLayers]{0, 1, 2, 1, 2, 1}, kTo[kLayers]{1, 2, 1, 2, 1, 0};
    for (int l = 0; l < kLayers; ++l) {
      dnnl::post_ops after;
      if (l == 2 || l == 4) after.append_sum();
      if (l + 1 < kLayers) after.append_eltwise(1.0f, dnnl::algorithm::eltwise_relu, 0.0f, 0.0f);
      dnnl::primitive_attr attributes;
      attributes.set_post_ops(after);
      const dnnl::inner_product_forward::desc layer(dnnl::prop_kind::forward_inference, plain, any(weights), bias,
                                                    plain);
      const dnnl::inner_product_forward::primitive_desc chosen(layer, attributes, m_engine);
      m_primitives.emplace_back(chosen);
      m_arguments.push_back({{DNNL_ARG_SRC, m_x[kFrom[l]]},
                             {DNNL_ARG_WEIGHTS, filled(chosen.weights_desc(), 0.01f)},
                             {DNNL_ARG_BIAS, filled(bias, 0.01f)},
                             {DNNL_ARG_DST, m_x[kTo[l]]}});
    }
  }
  void run() {
    for (int l = 0; l < kLayers; ++l) m_primitives[l].execute(m_stream, m_arguments[l]);
    m_stream.wait();
  }

 private:
  dnnl::memory filled(const dnnl::memory::desc& desc, float value) {
    dnnl::memory memory(desc, m_engine);
    std::fill_n(static_cast<float*>(memory.get_data_handle()), desc.get_size() / sizeof(float), value);
    return memory;
  }

  dnnl::engine m_engine;
  dnnl::stream m_stream;
  dnnl::memory m_x[3];
  std::vector<dnnl::inner_product_forward> m_primitives;
  std::vector<std::unordered_map<int, dnnl::memory>> m_arguments;
};

double nanoseconds_a_sample(int width, int batch) {
  using Clock = std::chrono::steady_clock;
  Net net(width, batch);
  const int rounds = 2'000'000 / (batch * width) + 1;
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20; ++i) {
    const auto start = Clock::now();
    for (int r = 0; r < rounds; ++r) net.run();
    best = std::min(best, std::chrono::duration<double, std::nano>(Clock::now() - start).count());
  }
  return best / rounds / batch;
}

}  // namespace

int main() {
  std::string line;
  for (const int width : {32, 64, 128}) {
    double best = std::numeric_limits<double>::infinity();
    for (const int batch : {64, 256, 1024, 4096}) best = std::min(best, nanoseconds_a_sample(width, batch));
    line += fmt::format("{}\"{}\": {}", line.empty() ? "" : ", ", width, best);
  }
  fmt::print("{{{}}}\n", line);
}
