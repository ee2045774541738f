from .base import (
    Constraint as Constraint,
)
from .base import (
    DerivedQuantity as DerivedQuantity,
)
from .base import (
    Effect as Effect,
)
from .base import (
    Field as Field,
)
from .base import (
    Force as Force,
)
from .base import (
    HardBodies as HardBodies,
)
from .base import (
    LongRange as LongRange,
)
from .base import (
    LongRangeSum as LongRangeSum,
)
from .base import (
    PairEvent as PairEvent,
)
from .base import (
    PairForce as PairForce,
)
from .base import (
    SelfConsistentQuantity as SelfConsistentQuantity,
)
from .base import (
    Vector as Vector,
)
from .base import (
    WorldField as WorldField,
)
from .base import (
    option as option,
)
from .base import (
    parameter as parameter,
)
from .constraint.prescribed_motion import PrescribedMotion as PrescribedMotion
from .constraint.rigid_clumps import RigidClumps as RigidClumps
from .constraint.rigid_mixture import RigidMixture as RigidMixture
from .constraint.rigid_rods import RigidRods as RigidRods
from .constraint.rigid_shapes import RigidShapes as RigidShapes
from .constraint.rigid_superquadrics import RigidSuperquadrics as RigidSuperquadrics
from .contact.bond import ContactBond as ContactBond
from .contact.capillary_bridge import CapillaryBridge as CapillaryBridge
from .contact.dissipation import ContactDissipation as ContactDissipation
from .contact.friction import ContactFriction as ContactFriction
from .contact.granular.cohesion import DMT as DMT
from .contact.granular.cohesion import SJKR as SJKR
from .contact.granular.constant import ConstantDamping as ConstantDamping
from .contact.granular.contact import GranularContact as GranularContact
from .contact.granular.granular import Granular as Granular
from .contact.granular.hertz import HertzMaterial as HertzMaterial
from .contact.granular.hooke import Hooke as Hooke
from .contact.granular.jkr import JKR as JKR
from .contact.granular.mindlin import (
    DisplacementSpring as DisplacementSpring,
)
from .contact.granular.mindlin import (
    LinearSpring as LinearSpring,
)
from .contact.granular.mindlin import (
    MindlinDisplacement as MindlinDisplacement,
)
from .contact.granular.mindlin import (
    MindlinForce as MindlinForce,
)
from .contact.granular.mindlin import (
    TangentialSpring as TangentialSpring,
)
from .contact.granular.parts import (
    Cohesion as Cohesion,
)
from .contact.granular.parts import (
    ContactPart as ContactPart,
)
from .contact.granular.parts import (
    Damping as Damping,
)
from .contact.granular.parts import (
    NormalForce as NormalForce,
)
from .contact.granular.parts import (
    RollingResistance as RollingResistance,
)
from .contact.granular.parts import (
    TangentialForce as TangentialForce,
)
from .contact.granular.parts import (
    TwistingResistance as TwistingResistance,
)
from .contact.granular.restitution import RestitutionDamping as RestitutionDamping
from .contact.granular.rolling import (
    RollingCDT as RollingCDT,
)
from .contact.granular.rolling import (
    RollingEPSD as RollingEPSD,
)
from .contact.granular.rolling import (
    RollingSDS as RollingSDS,
)
from .contact.granular.twisting import (
    TwistingMarshall as TwistingMarshall,
)
from .contact.granular.twisting import (
    TwistingSDS as TwistingSDS,
)
from .contact.granular.viscoelastic import ViscoelasticDamping as ViscoelasticDamping
from .contact.granular.viscous import ViscousFriction as ViscousFriction
from .contact.hard_mixture import HardMixture as HardMixture
from .contact.hard_rods import HardRods as HardRods
from .contact.hard_superquadrics import HardSuperquadrics as HardSuperquadrics
from .contact.hertz import Hertz as Hertz
from .contact.normal import NormalContact as NormalContact
from .contact.parallel_bond import ParallelBond as ParallelBond
from .contact.power_law import Contact as Contact
from .contact.power_law import ContactLaw as ContactLaw
from .contact.softening import ContactSoftening as ContactSoftening
from .contact.surface import SurfaceContact as SurfaceContact
from .external.drag import (
    ChowDrag as ChowDrag,
)
from .external.drag import (
    ConstantDrag as ConstantDrag,
)
from .external.drag import (
    Drag as Drag,
)
from .external.drag import (
    SchillerNaumannDrag as SchillerNaumannDrag,
)
from .external.drag import (
    StokesDrag as StokesDrag,
)
from .external.gravity import Gravity as Gravity
from .external.lorentz import Lorentz as Lorentz
from .external.tether import Tether as Tether
from .gravitation.self_gravity import (
    SelfGravity as SelfGravity,
)
from .gravitation.self_gravity import (
    SoftenedSelfGravity as SoftenedSelfGravity,
)
from .gravitation.tree_gravity import TreeGravity as TreeGravity
from .impact.agglomeration import Agglomeration as Agglomeration
from .impact.friction import Friction as Friction
from .impact.heating import DeformationWork as DeformationWork
from .impact.heating import Heating as Heating
from .impact.impact import Impact as Impact
from .impact.law import ImpactLaw as ImpactLaw
from .impact.reaction import Reaction as Reaction
from .impact.softening import Softening as Softening
from .magnetic.body_force import MagneticBodyForce as MagneticBodyForce
from .magnetic.dipole_dipole import DipoleDipole as DipoleDipole
from .magnetic.dipole_dipole import TruncatedDipoleDipole as TruncatedDipoleDipole
from .magnetic.ewald_accuracy import ewald_settings as ewald_settings
from .magnetic.ewald_dipole_dipole import EwaldDipoleDipole as EwaldDipoleDipole
from .magnetic.ewald_moment import (
    EwaldFroehlichMoment as EwaldFroehlichMoment,
)
from .magnetic.ewald_moment import (
    EwaldInducedMoment as EwaldInducedMoment,
)
from .magnetic.ewald_moment import (
    EwaldLangevinMoment as EwaldLangevinMoment,
)
from .magnetic.ewald_moment import (
    EwaldMoment as EwaldMoment,
)
from .magnetic.magnetic_materials import (
    CARBONYL_IRON as CARBONYL_IRON,
)
from .magnetic.magnetic_materials import (
    IRON as IRON,
)
from .magnetic.magnetic_materials import (
    MAGNETITE as MAGNETITE,
)
from .magnetic.magnetic_materials import (
    MagneticMaterial as MagneticMaterial,
)
from .magnetic.magnetophoresis import Magnetophoresis as Magnetophoresis
from .magnetic.moment import (
    FixedMoment as FixedMoment,
)
from .magnetic.moment import (
    FroehlichMoment as FroehlichMoment,
)
from .magnetic.moment import (
    InducedMoment as InducedMoment,
)
from .magnetic.moment import (
    LangevinMoment as LangevinMoment,
)
from .magnetic.moment import (
    Moment as Moment,
)
from .magnetic.mutual_moment import (
    MutualFroehlichMoment as MutualFroehlichMoment,
)
from .magnetic.mutual_moment import (
    MutualInducedMoment as MutualInducedMoment,
)
from .magnetic.mutual_moment import (
    MutualLangevinMoment as MutualLangevinMoment,
)
from .magnetic.mutual_moment import (
    MutualMoment as MutualMoment,
)
from .magnetic.permanent_moment import PermanentMoment as PermanentMoment
from .pair.mie import Mie as Mie
from .pair.morse import Morse as Morse
from .pair.near_field import NearField as NearField
from .pair.near_field import TruncatedNearField as TruncatedNearField
from .pair.virial import Virial as Virial
from .walls.confinement import Confinement as Confinement
from .walls.motion import Fixed as Fixed
from .walls.motion import Motion as Motion
from .walls.oscillation import Oscillation as Oscillation
from .walls.rotation import Rotation as Rotation
from .walls.servo import Servo as Servo
from .walls.translation import Translation as Translation
from .walls.walls import Walls as Walls
