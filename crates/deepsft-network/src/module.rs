//! [`Network`] as a burn module. burn's derive would put the variant's name before every weight's path.

use super::any_network::{Network, any, same_kind};
use burn::module::{Content, Devices, Module, ModuleDisplay, ModuleDisplayDefault, ModuleMapper, ModuleVisitor};
use burn::tensor::Device;

impl Module for Network {
    fn collect_devices(&self, devices: Devices) -> Devices {
        any!(self, network => network.collect_devices(devices))
    }

    fn fork(self, device: &Device) -> Self {
        same_kind!(self, network => network.fork(device))
    }

    fn to_device(self, device: &Device) -> Self {
        same_kind!(self, network => network.to_device(device))
    }

    fn visit<Visitor: ModuleVisitor>(&self, visitor: &mut Visitor) {
        any!(self, network => network.visit(visitor));
    }

    fn map<Mapper: ModuleMapper>(self, mapper: &mut Mapper) -> Self {
        same_kind!(self, network => network.map(mapper))
    }

    fn train(self) -> Self {
        same_kind!(self, network => network.train())
    }

    fn valid(&self) -> Self {
        same_kind!(self, network => network.valid())
    }

    fn materialize(self) -> Self {
        same_kind!(self, network => network.materialize())
    }
}

impl ModuleDisplayDefault for Network {
    fn content(&self, content: Content) -> Option<Content> {
        any!(self, network => network.content(content))
    }

    fn num_params(&self) -> usize {
        Module::num_params(self)
    }
}

impl ModuleDisplay for Network {}
