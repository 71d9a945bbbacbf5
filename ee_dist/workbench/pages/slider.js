// Quasar's slider, which follows the hand by itself and tells each value it comes to, at most one in a while; where it is let go of
// it tells after all others, so that nothing comes late. While a hand is on it nobody else moves it.
const PAUSE_MS = 20;

export default {
  template: '<q-slider v-bind="$attrs" :model-value="value" @update:model-value="move" @change="release" />',
  props: { begin: Number },
  emits: ["moved", "released"],
  data() {
    return { value: this.begin };
  },
  unmounted() {
    clearTimeout(this.pause);
  },
  methods: {
    move(value) {
      this.value = value;
      this.held = true;
      if (this.pause) {
        this.more = true;
        return;
      }
      this.$emit("moved", value);
      this.pause = setTimeout(() => {
        this.pause = null;
        if (this.more) {
          this.more = false;
          this.move(this.value);
        }
      }, PAUSE_MS);
    },
    release(value) {
      clearTimeout(this.pause);
      this.pause = null;
      this.more = this.held = false;
      this.value = value;
      this.$emit("released", value);
    },
    show(value) {
      if (!this.held) this.value = value;
    },
  },
};
