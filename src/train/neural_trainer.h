#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "train/field_trainer.h"
#include "warp/neural.h"

namespace warpath {

/// Learns a Neural warp from the vertices of passes: its field as FieldTrainer does, and after each pass but the first
/// the network, on vertices of that pass, which the field that it corrects has not seen yet. So it learns, too, how far
/// the field is to be trusted.
///
/// What is minimised is the mean of -w ln q over vertices [MMRGN19], where w is what came back, f / q of the draw, over
/// its mean in the field's cell: so that dark places count as much as bright ones. Vertices are kept with a probability
/// proportional to w (importance resampling [TCE05]), since those to which nothing comes back teach nothing.
class NeuralTrainer final : public VertexTrainer {
 public:
  /// light_parts: number of equally likely emitters; 1 if there is no choice among them.
  NeuralTrainer(const NeuralSettings& settings, int light_parts, std::uint64_t seed);
  ~NeuralTrainer() override;

  std::unique_ptr<VertexRecorder> make_recorder() const override;
  void merge(VertexRecorder& recorder) override;
  std::shared_ptr<const VertexWarp> warp() override { return fit(); }
  std::shared_ptr<const Neural> fit();

 private:
  class Recorder;
  struct Example;
  struct Means;
  struct Scratch;

  void find_box();
  void train();
  /// One step of Adam on the vertices first, first + stride, ... modulo their number.
  void step(std::size_t first, std::size_t stride, double rate);
  void gradients_of_slot(std::size_t slot, std::size_t first, std::size_t stride);
  void fit_field();

  NeuralSettings m_settings;
  FieldTrainer m_field_trainer;
  std::shared_ptr<const VertexNetwork> m_network;
  VertexBox m_box;
  nn::AlignedVector<float> m_parameters, m_m, m_v, m_gradients, m_packed, m_packed_back, m_transposed;
  std::array<const float*, VertexNetwork::kHeads> m_transposed_head;
  std::vector<Scratch> m_scratch;  // one for each slot
  int m_steps = 0;

  // As they were before this pass: recorders use them while batches are merged.
  std::shared_ptr<const Field> m_field;
  std::shared_ptr<const Means> m_means;
  double m_level = 0;               // a vertex of so much w is kept for sure
  std::vector<Example> m_examples;  // of this pass
  double m_seen = 0;                // vertices of all passes
};

}  // namespace warpath
