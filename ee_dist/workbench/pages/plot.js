// A chart: what is drawn comes from the session as plain data for plotly. The toolkit's own chart hands it data that tell of every
// number that is looked at.
const TOLD = {
  plotly_click: (e) => ({ points: places(e) }),
  plotly_hover: (e) => ({ points: places(e) }),
  plotly_selected: (e) => ({ points: places(e) }),
  plotly_deselect: () => ({}),
  plotly_relayout: (e) => e,
};
const places = (event) => (event?.points ?? []).map(({ x, y, customdata }) => ({ x, y, customdata }));

export default {
  template: "<div></div>",
  props: { figure: Object },
  emits: Object.keys(TOLD),
  async mounted() {
    await import("/plotly.js");
    if (this.gone) return;
    this.ready = true;
    this.update();
    this.fits = new ResizeObserver(() => this.fit());
    this.fits.observe(this.$el);
  },
  unmounted() {
    this.gone = true;
    this.fits?.disconnect();
    if (this.drawn) Plotly.purge(this.$el);
  },
  methods: {
    // The whole figure, once there is one: no empty chart is drawn first.
    update() {
      if (!this.ready || !this.figure) return;
      const figure = Vue.toRaw(this.figure);
      Plotly.react(this.$el, figure.data, figure.layout, figure.config);
      if (this.drawn) return;
      this.drawn = true;
      for (const name in TOLD) this.$el.on(name, (event) => this.$emit(name, TOLD[name](event)));
    },
    // Other numbers of the same lines.
    renumber(x, y) {
      if (this.drawn) Plotly.restyle(this.$el, { x, y });
    },
    // In a tab that is put away it has no place to fit.
    fit() {
      const { clientWidth: width, _fullLayout: drawn } = this.$el;
      if (width && drawn && Math.abs(width - drawn.width) >= 1) Plotly.Plots.resize(this.$el);
    },
  },
};
