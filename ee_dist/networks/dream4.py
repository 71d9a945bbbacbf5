"""Network 1 of size 10 of the DREAM4 in-silico challenge, with the parameters that its organisers published.

Structure from *Escherichia coli*, kinetics drawn by GeneNetWeaver: D. Marbach, R. J. Prill, T. Schaffter, C. Mattiussi,
D. Floreano, G. Stolovitzky, "Revealing strengths and weaknesses of methods for gene network inference", PNAS 107 (2010) 6286;
file ``insilico_size10_1.xml`` of GeneNetWeaver. The stimuli are the perturbations of DREAM4's time series, shifts of a gene's
basal activation, here of the three genes that nothing regulates. Four genes have reporters; the others are not seen.
"""

from __future__ import annotations

from ee_dist.networks.model import Gene, GeneNetwork, Link, Module, Stimulus, Wanted
from ee_dist.robots.model import Sensor, Wiring

GENES = (
    Gene("G1", *(0.02198591818543997,) * 2, *(0.0294749131957585,) * 2, (1.0,)),
    Gene(
        "G2", *(0.037329506101221294,) * 2, *(0.01914504849197947,) * 2,
        (1.0, 0.36224480014468297, 0.3642788734615722, 0.0),
        (
            Module((Link("G8", 0.8202957653230988, 2.417515812506219),), complex=True),
            Module(
                (
                    Link("G6", 0.10124375272542238, 4.9149901237068505),
                    Link("G1", 0.033431552816182375, 3.3852618871162323),
                ),
                complex=True,
            ),
        ),
    ),
    Gene(
        "G3", *(0.0352392844872434,) * 2, *(0.027130583729343953,) * 2,
        (0.519005173831996, 0.0, 1.0, 0.3798047960226494, 1.0, 0.4401718920153618, 1.0, 0.9946499581776337),
        (
            Module((Link("G4", 0.2660600562696345, 1.4974109550949721),), complex=True),
            Module((Link("G10", 0.8830312644317746, 2.217121248268233),), complex=True),
            Module(
                (
                    Link("G7", 0.7435349195450545, 4.891663865868665),
                    Link("G1", 0.014286839594133198, 5.696457087916404),
                )
            ),
        ),
    ),
    Gene(
        "G4", *(0.03127428119299273,) * 2, *(0.016684256058119955,) * 2,
        (0.05289828722376213, 0.5919356052054463, 0.5843179093324918, 1.0),
        (
            Module(
                (
                    Link("G3", 0.24478703659726309, 2.4879549869601116),
                    Link("G7", 0.9764379764068871, 2.292019162410937),
                    Link("G10", 0.5676484319218434, 2.604723136385508),
                ),
                complex=True,
            ),
            Module((Link("G1", 0.3284524600254372, 2.494697348851522),)),
        ),
    ),
    Gene(
        "G5", *(0.027465993591510605,) * 2, *(0.027933611026288035,) * 2, (1.0, 0.04839378419244156),
        (Module((Link("G1", 0.4841788942203857, 2.600091568383157),)),),
    ),
    Gene(
        "G6", *(0.016773981465267117,) * 2, *(0.01845757409850252,) * 2, (1.0, 0.04161895335252508),
        (Module((Link("G8", 0.8341630530823022, 1.2067179670869939),), complex=True),),
    ),
    Gene(
        "G7", *(0.025748951570162618,) * 2, *(0.02157385188259173,) * 2, (1.0, 0.014419186027356368),
        (Module((Link("G3", 0.6391504655312746, 5.077798765033641),)),),
    ),
    Gene("G8", *(0.02204316313251564,) * 2, *(0.03204329983430016,) * 2, (1.0,)),
    Gene("G9", *(0.017703335167995143,) * 2, *(0.020183785426918725,) * 2, (1.0,)),
    Gene(
        "G10", *(0.02393531061330784,) * 2, *(0.023303524238406665,) * 2, (0.07171511841122566, 1.0),
        (Module((Link("G9", 0.22689975995570422, 4.02906374917333),)),),
    ),
)  # fmt: skip
STIMULATED = ("G1", "G8", "G9")
REPORTED = ("G2", "G4", "G5", "G7")
OUTPUT = "G4"
HOUR_S = 3600.0
WANTED = ((4 * HOUR_S, 0.3), (9 * HOUR_S, 0.3), (12 * HOUR_S, 0.5))
"""Without a stimulus the output stands at 0.95. It is to be held down, and then to rise again half way."""


def dream4(
    output: str = OUTPUT,
    levels: tuple[tuple[float, float], ...] = WANTED,
    stimulated: tuple[str, ...] = STIMULATED,
    reported: tuple[str, ...] = REPORTED,
) -> GeneNetwork:
    """The network, of whose gene ``output`` the ``levels`` (time in s, level) are wanted, with stimuli and reporters of these
    genes. Raises NetworkError for a gene that it does not have, or an output without a reporter."""
    return GeneNetwork(
        name="dream4_size10_1",
        genes=GENES,
        drives=tuple(Stimulus(f"stimulus_{g}", g) for g in stimulated),
        sensors=tuple(Sensor(f"level_{g}", "expression", g) for g in reported),
        wiring=Wiring(tuple(range(len(stimulated)))),
        wanted=Wanted(f"level_{output}", levels),
    )
